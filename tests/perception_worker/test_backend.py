"""The two backends, held to the same: a pose network gives the same maps whatever runs it."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.backend import open_network
from perception_worker.models import OPENPOSE_MOBILENET_THIN
from perception_worker.network import pose_outputs
from perception_worker.onnxruntime_network import OnnxRuntimeNetwork
from perception_worker.openvino_network import OpenVinoNetwork
from perception_worker.region import Region
from protocol.config import PerceptionConfig
from protocol.errors import ArtifactDamaged, ArtifactMissing, InvalidConfig

BOTH = pytest.mark.parametrize("backend", ["openvino", "onnxruntime"])


@pytest.fixture
def config(tiny_onnx):
    return PerceptionConfig(network=str(tiny_onnx), rows=64, columns=96)


@pytest.fixture
def image():
    return np.random.default_rng(5).uniform(0, 255, (3, 64, 96)).astype(np.float32)


def seen_by(network, image):
    output = network.infer(image)
    return np.concatenate([output.heatmaps, output.pafs])


class TestEachBackend:
    @BOTH
    def test_gives_heatmaps_and_fields_of_the_image_s_size(self, config, image, backend):
        output = open_network(replace(config, backend=backend)).infer(image)
        assert (output.heatmaps.shape, output.pafs.shape) == ((19, 8, 12), (38, 8, 12))
        assert (output.heatmaps.dtype, output.pafs.dtype) == (np.float32, np.float32)

    @BOTH
    def test_knows_the_size_that_it_was_opened_for(self, config, backend):
        assert open_network(replace(config, backend=backend)).input_size == (64, 96)

    @BOTH
    def test_gives_maps_that_the_next_inference_leaves_alone(self, config, image, backend):
        network = open_network(replace(config, backend=backend))
        first = network.infer(image)
        kept = first.heatmaps.copy()
        network.infer(255 - image)
        assert (first.heatmaps == kept).all()

    @BOTH
    def test_may_be_called_by_several_threads_at_once(self, config, backend):
        network = open_network(replace(config, backend=backend))
        images = np.random.default_rng(6).uniform(0, 255, (40, 3, 64, 96)).astype(np.float32)
        expected = [seen_by(network, image) for image in images]
        with ThreadPoolExecutor(4) as threads:
            together = list(threads.map(lambda image: seen_by(network, image), images))
        assert all((one == other).all() for one, other in zip(expected, together, strict=True))

    def test_gives_what_the_other_gives(self, config, image):
        one, other = (open_network(replace(config, backend=backend)) for backend in ("openvino", "onnxruntime"))
        assert seen_by(one, image) == pytest.approx(seen_by(other, image), rel=1e-5, abs=1e-2)


class TestChoice:
    def test_without_a_gpu_is_openvino(self, config):
        assert isinstance(open_network(config), OpenVinoNetwork)

    def test_of_onnx_runtime_is_followed(self, config):
        network = open_network(replace(config, backend="onnxruntime"))
        assert isinstance(network, OnnxRuntimeNetwork)
        assert network.provider == "CPUExecutionProvider"

    def test_of_bfloat16_is_refused_where_there_is_none(self, config):
        with pytest.raises(InvalidConfig, match=r"perception\.precision: bf16"):
            open_network(replace(config, backend="onnxruntime", precision="bf16"))


class TestUnusableFile:
    @BOTH
    def test_with_other_outputs_is_refused_by_naming_them(self, config, logits_onnx, backend):
        with pytest.raises(InvalidConfig, match=r"logits\.onnx gives logits \[.*3.*\].*heatmaps \[n, 19"):
            open_network(replace(config, network=str(logits_onnx), backend=backend))

    @BOTH
    def test_that_is_no_network_is_refused(self, config, tmp_path, backend):
        file = tmp_path / "words.onnx"
        file.write_text("not a network")
        with pytest.raises(InvalidConfig, match=r"perception\.network: .*words\.onnx"):
            open_network(replace(config, network=str(file), backend=backend))

    @BOTH
    def test_that_takes_another_image_is_refused(self, config, grey_onnx, backend):
        with pytest.raises(InvalidConfig, match=r"grey\.onnx on images of 64×96"):
            open_network(replace(config, network=str(grey_onnx), backend=backend))

    def test_that_is_not_there_is_named(self, config):
        with pytest.raises(InvalidConfig, match=r"there is no file nowhere\.onnx"):
            open_network(replace(config, network="nowhere.onnx"))

    def test_that_was_never_pulled_names_the_command(self, tmp_path, monkeypatch):
        monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
        with pytest.raises(ArtifactMissing, match="orchestrator models pull"):
            open_network(PerceptionConfig())

    def test_that_was_damaged_names_the_command(self, tmp_path, monkeypatch):
        whole = OPENPOSE_MOBILENET_THIN.path.read_bytes()
        monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
        OPENPOSE_MOBILENET_THIN.path.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
        with pytest.raises(ArtifactDamaged, match="orchestrator models pull"):
            open_network(PerceptionConfig())


class TestPoseOutputs:
    def test_are_told_by_their_channels_whatever_their_names(self):
        outputs = {"a": ["n", 38, "h", "w"], "b": ["n", 19, "h", "w"], "c": [1]}
        assert pose_outputs(outputs, Path("x.onnx")) == ("b", "a")


@pytest.mark.slow
class TestRealNetwork:
    @pytest.fixture
    def photograph(self, astronaut):
        return Region.whole(384, 384).image(astronaut, (240, 320))

    def test_openvino_in_f32_gives_what_onnx_runtime_gives(self, photograph):
        one, other = (open_network(PerceptionConfig(backend=backend)) for backend in ("openvino", "onnxruntime"))
        difference = np.abs(seen_by(one, photograph) - seen_by(other, photograph))
        assert difference.max() < 1e-4

    @BOTH
    def test_one_thread_and_two_give_the_same_bytes(self, photograph, backend):
        one, two = (open_network(PerceptionConfig(backend=backend, threads=threads)) for threads in (1, 2))
        assert seen_by(one, photograph).tobytes() == seen_by(two, photograph).tobytes()

    def test_the_same_frame_gives_the_same_bytes_again(self, photograph):
        network = open_network(PerceptionConfig())
        assert seen_by(network, photograph).tobytes() == seen_by(network, photograph).tobytes()
