"""What a build for GPUs does on a machine that lacks some of their libraries; no GPU is needed to see it."""

import onnxruntime
import pytest

from perception_worker.networks.onnxruntime_engine import CPU, CUDA, TENSORRT, OnnxRuntimeEngine
from protocol.errors import InvalidConfig


@pytest.fixture
def asked_of(monkeypatch):
    """A build for GPUs that lacks a provider's libraries; returns what it is asked for, and does it on the CPU."""
    real = onnxruntime.InferenceSession
    monkeypatch.setattr(onnxruntime, "get_available_providers", lambda: [TENSORRT, CUDA, CPU])

    def lacking(missing):
        asked = []

        def session(file, options, *, providers, enable_fallback):
            assert not enable_fallback
            asked.append(providers)
            if providers[0][0] in missing:
                raise RuntimeError("Please install TensorRT libraries")
            return real(file, options, providers=[CPU])

        monkeypatch.setattr(onnxruntime, "InferenceSession", session)
        return asked

    return lacking


def opened(file):
    return OnnxRuntimeEngine(file, input_size=(64, 96), default_size=(64, 96), threads=1)


def test_without_tensorrt_cuda_keeps_its_options(asked_of, tiny_onnx):
    asked = asked_of({TENSORRT})
    opened(tiny_onnx)
    assert [providers[0][0] for providers in asked] == [TENSORRT, CUDA]
    assert asked[-1] == [(CUDA, {"use_tf32": False}), CPU]


def test_without_any_of_them_the_cpu_is_left(asked_of, tiny_onnx):
    asked = asked_of({TENSORRT, CUDA})
    assert opened(tiny_onnx).provider == CPU
    assert asked[-1] == [CPU]


def test_a_file_that_is_no_network_is_refused_all_the_same(asked_of, tmp_path):
    asked_of(set())
    file = tmp_path / "no_network.onnx"
    file.write_bytes(b"nothing")
    with pytest.raises(InvalidConfig, match="no_network"):
        opened(file)
