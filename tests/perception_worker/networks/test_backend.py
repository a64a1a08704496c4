"""The two backends, held to the same: a pose network gives the same maps whatever runs it."""

import re
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.networks.backend import input_size, network_name, open_network
from perception_worker.networks.models import DEFAULTS, KNOWN, OPENPOSE_MOBILENET_THIN
from perception_worker.networks.onnxruntime_engine import OnnxRuntimeEngine
from perception_worker.networks.openvino_engine import OpenVinoEngine
from protocol.config import PerceptionConfig
from protocol.errors import ArtifactDamaged, ArtifactMissing, InvalidConfig, InvalidOutput
from protocol.skeleton import Joint

BOTH = pytest.mark.parametrize("backend", ["openvino", "onnxruntime"])


@pytest.fixture
def config(tiny_onnx):
    return PerceptionConfig(network=str(tiny_onnx), input_height=64, input_width=96)


@pytest.fixture
def image():
    return np.random.default_rng(5).integers(0, 256, (64, 96, 3), np.uint8)


def seen_by(network, image):
    output = network.infer(image)
    return np.concatenate([output.heatmaps, output.pafs])


def engine_of(network):
    return network._engine


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
        images = np.random.default_rng(6).integers(0, 256, (40, 64, 96, 3), np.uint8)
        expected = [seen_by(network, image) for image in images]
        with ThreadPoolExecutor(4) as threads:
            together = list(threads.map(lambda image: seen_by(network, image), images))
        assert all((one == other).all() for one, other in zip(expected, together, strict=True))

    def test_gives_what_the_other_gives(self, config, image):
        one, other = (open_network(replace(config, backend=backend)) for backend in ("openvino", "onnxruntime"))
        assert seen_by(one, image) == pytest.approx(seen_by(other, image), rel=1e-5, abs=1e-2)


class TestChoice:
    def test_without_a_gpu_is_openvino(self, config):
        assert isinstance(engine_of(open_network(config)), OpenVinoEngine)

    def test_of_onnx_runtime_is_followed(self, config):
        engine = engine_of(open_network(replace(config, backend="onnxruntime")))
        assert isinstance(engine, OnnxRuntimeEngine)
        assert engine.provider == "CPUExecutionProvider"

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
        with pytest.raises(InvalidConfig, match=r"grey\.onnx takes image float32 \[any, 1, any.* \[1, 3, 64, 96\]"):
            open_network(replace(config, network=str(grey_onnx), backend=backend))

    @BOTH
    def test_that_takes_whole_numbers_is_refused(self, config, integer_onnx, backend):
        with pytest.raises(InvalidConfig, match=r"integer\.onnx"):
            open_network(replace(config, network=str(integer_onnx), backend=backend))

    def test_that_is_not_there_is_named(self, config):
        with pytest.raises(InvalidConfig, match=r"there is no file nowhere\.onnx.* known are openpose_mobilenet_thin"):
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


class TestSize:
    @BOTH
    def test_is_the_file_s_own_where_the_configuration_names_none(self, fixed_onnx, backend):
        network = open_network(PerceptionConfig(network=str(fixed_onnx), backend=backend))
        assert network.input_size == (72, 88)

    @BOTH
    def test_is_the_usual_one_where_the_file_takes_any(self, tiny_onnx, backend):
        network = open_network(PerceptionConfig(network=str(tiny_onnx), backend=backend))
        assert network.input_size == (240, 320)

    def test_of_a_network_of_one_size_can_be_no_other(self):
        with pytest.raises(InvalidConfig, match=r"movenet_thunder takes images of 256×256 and no others"):
            open_network(PerceptionConfig(network="movenet_thunder", input_height=240, input_width=320))

    def test_is_told_before_the_network_is_opened(self, tiny_onnx):
        assert input_size(PerceptionConfig()) == (240, 320)
        assert input_size(PerceptionConfig(input_height=256)) == (256, 320)
        assert input_size(PerceptionConfig(network="movenet_lightning")) == (192, 192)
        assert input_size(PerceptionConfig(network=str(tiny_onnx))) is None


class TestKnownName:
    def test_that_was_never_pulled_names_the_command(self, tmp_path, monkeypatch):
        monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
        with pytest.raises(ArtifactMissing, match="orchestrator models pull blazepose_full"):
            open_network(PerceptionConfig(network="blazepose_full"))

    def test_needs_nobody_to_tell_its_layout(self):
        with pytest.raises(InvalidConfig, match=r"perception\.layout, perception\.pixels: those of movenet_lightning"):
            open_network(PerceptionConfig(network="movenet_lightning", layout="openpose"))

    def test_is_what_a_file_is_called_in_messages(self, tiny_onnx):
        assert network_name(PerceptionConfig()) == "openpose_mobilenet_thin"
        assert network_name(PerceptionConfig(look="track")) == "openpose_mobilenet_thin_5"
        assert network_name(PerceptionConfig(network="movenet_thunder")) == "movenet_thunder"
        assert network_name(PerceptionConfig(network=str(tiny_onnx))) == "tiny.onnx"

    def test_with_a_file_of_other_outputs_behind_it_is_refused(self, movenet_of_other_outputs):
        with pytest.raises(InvalidConfig, match=r"movenet_lightning gives .*logits.*not .*heatmaps.*\(17, 48, 48\)"):
            open_network(PerceptionConfig(network="movenet_lightning"))


class TestNotFinite:
    @BOTH
    def test_heatmaps_are_an_error_and_no_pose(self, nan_onnx, image, backend):
        network = open_network(
            PerceptionConfig(network=str(nan_onnx), input_height=64, input_width=96, backend=backend)
        )
        with pytest.raises(InvalidOutput, match=re.escape("nan.onnx gave heatmaps that are not finite")):
            network.infer(image)


@pytest.mark.slow
@pytest.mark.parametrize("name", [network.name for network in DEFAULTS])
class TestRealNetwork:
    @pytest.fixture
    def photograph(self, astronaut):
        return astronaut

    def test_openvino_in_f32_gives_what_onnx_runtime_gives(self, name, photograph):
        one, other = (
            open_network(PerceptionConfig(network=name, backend=backend)) for backend in ("openvino", "onnxruntime")
        )
        difference = np.abs(seen_by(one, photograph) - seen_by(other, photograph))
        assert difference.max() < 1e-4

    @BOTH
    def test_one_thread_and_two_give_the_same_bytes(self, name, photograph, backend):
        one, two = (
            open_network(PerceptionConfig(network=name, backend=backend, threads=threads)) for threads in (1, 2)
        )
        assert seen_by(one, photograph).tobytes() == seen_by(two, photograph).tobytes()

    def test_the_same_frame_gives_the_same_bytes_again(self, name, photograph):
        network = open_network(PerceptionConfig(network=name))
        assert seen_by(network, photograph).tobytes() == seen_by(network, photograph).tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in KNOWN if KNOWN[name] not in DEFAULTS])
class TestOtherRealNetwork:
    @pytest.fixture(autouse=True)
    def pulled(self, name):
        if not KNOWN[name].path.is_file():
            pytest.skip(f"{name} is not in the cache; 'orchestrator models pull {name}' puts it there")

    def test_gives_the_same_on_both_backends(self, name, astronaut):
        one, other = (
            open_network(PerceptionConfig(network=name, backend=backend)) for backend in ("openvino", "onnxruntime")
        )
        difference = np.abs(seen_by_single(one, astronaut) - seen_by_single(other, astronaut))
        assert difference.max() < 1e-4

    def test_finds_the_face_of_an_astronaut(self, name, astronaut):
        network = open_network(PerceptionConfig(network=name))
        output = network.infer(astronaut)
        cells = output.heatmaps.shape[1]
        pixels = (network.decode(output).person + 0.5) * 384 / cells - 0.5
        found = pixels[[Joint.NOSE, Joint.RIGHT_EYE, Joint.LEFT_EYE]]
        assert found == pytest.approx(np.array([[169, 94], [154, 76], [187, 77]]), abs=6)

    def test_finds_nobody_in_a_black_picture(self, name):
        network = open_network(PerceptionConfig(network=name))
        assert np.isnan(network.decode(network.infer(np.zeros((480, 640, 3), np.uint8))).person).all()


def seen_by_single(network, rgb):
    return network.infer(rgb).heatmaps
