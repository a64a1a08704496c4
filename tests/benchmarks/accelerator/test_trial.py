from pathlib import Path

import numpy as np
import pytest

from benchmarks.accelerator.jobs import Missing
from benchmarks.accelerator.measured import Measured, save_arrays
from benchmarks.accelerator.places import Place
from benchmarks.accelerator.trial import KINDS, Trial

CPU, GPU = Place("CPU", {}), Place("GPU", {})


class Told:
    """Jobs that find the same everywhere but where they are told that nothing is, and keep what they were asked."""

    def __init__(self, directory: Path, missing=()) -> None:
        self.asked: list[str] = []
        self._directory = directory
        self._missing = missing

    def arrays(self, name):
        return self._directory / f"{name}.npz"

    def measure(self, name, module, place, *options):
        self.asked.append(name)
        if name in self._missing:
            return Missing("not here")
        digests = save_arrays(self.arrays(name), {"rgb": np.full(3, len(self.asked))})
        return Measured(device=place.name, on_gpu=place == GPU, seconds={}, digests=digests)

    def train(self, name, place, config, *, longest):
        self.asked.append(name)
        return Missing("not tried here")


@pytest.fixture
def trial_of(tmp_path):
    def made(missing=(), only=KINDS):
        jobs = Told(tmp_path, missing)
        trial = Trial(jobs, CPU, GPU, frames=1, updates=1, only=only)
        trial.measure()
        trial.loops(1)
        trial.repeat()
        trial.perceive_gpu_frames()
        return trial, [name.replace("openvino", "cpu") for name in jobs.asked]

    return made


def test_all_is_measured_once_before_anything_is_repeated_and_the_gpu_is_repeated_first(trial_of):
    _, asked = trial_of()
    assert asked == [
        "render-CPU",
        "render-GPU",
        "perceive-CPU-cpu-CPU",
        "perceive-GPU-onnxruntime-CPU",
        "learn-CPU",
        "learn-GPU",
        "loop-GPU",
        "loop-CPU",
        "perceive-GPU-onnxruntime-CPU-again",
        "learn-GPU-again",
        "render-GPU-again",
        "perceive-CPU-cpu-CPU-again",
        "learn-CPU-again",
        "render-CPU-again",
        "perceive-GPU-onnxruntime-GPU",
    ]


def test_pytorch_infers_where_onnxruntime_has_no_gpu(trial_of):
    _, asked = trial_of(missing=("perceive-GPU-onnxruntime-CPU",), only=("perceive",))
    assert asked[3:5] == ["perceive-GPU-onnxruntime-CPU", "perceive-GPU-torch-CPU"]
    assert asked[-1] == "perceive-GPU-torch-GPU"


def test_what_is_needed_comes_along_and_is_not_repeated(trial_of):
    assert trial_of(only=("learn",))[1] == ["learn-CPU", "learn-GPU", "learn-GPU-again", "learn-CPU-again"]
    assert trial_of(only=("loop",))[1] == ["render-CPU", "render-GPU", "loop-GPU", "loop-CPU"]


def test_no_training_is_tried_on_a_gpu_that_is_not_there(trial_of):
    assert trial_of(missing=("render-GPU",), only=("loop",))[1][2:] == ["loop-CPU"]


def test_differences_are_from_the_cpus_and_from_the_first_time(trial_of):
    trial, _ = trial_of(only=("render",))
    assert [title for title, _ in trial.differences()] == [
        "render on the GPU",
        "render on the GPU: again, against the first time",
        "render on the CPU: again, against the first time",
    ]
