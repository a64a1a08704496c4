"""What can't be a picture of a person: a typed error or nobody found, never a wrong number."""

import numpy as np
import pytest

from perception_worker.detection import TrackingDetector, WholeFrameDetector
from perception_worker.networks.backend import open_network
from perception_worker.networks.layout import FoundLayout
from perception_worker.networks.network import NetworkOutput
from perception_worker.networks.openpose_network import OpenPoseNetwork
from perception_worker.perceive import Perceiver
from protocol import Client
from protocol.config import PerceptionConfig
from protocol.errors import InvalidOutput, Rejected
from protocol.messages import Perceive, Render, Role
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint, weighted_uncertainty
from protocol.system.exit_code import ExitCode
from tests.perception_worker.drawn_maps import DrawnNetwork, draw, person
from tests.perception_worker.workers import PATIENCE, running
from tests.serving import serving

BLACK = np.zeros((480, 640, 3), np.uint8)
STANDING = person(20, 14)


class Engine:
    """Gives one output after the other, whatever it is shown, and then the last one again."""

    input_size = (240, 320)

    def __init__(self, *outputs):
        self.looks = 0
        self._outputs = outputs

    def run(self, image):
        self.looks += 1
        output = self._outputs[min(self.looks, len(self._outputs)) - 1]
        return {"heatmaps": output.heatmaps, "pafs": output.pafs}


def gives(heatmaps, pafs):
    """A network of OpenPose's kind that gives the same maps whatever it looks at."""
    return network_of(Engine(NetworkOutput(heatmaps, pafs)))


def network_of(engine):
    layout = FoundLayout("openpose", "heatmaps", "pafs")
    return OpenPoseNetwork(engine, layout, pixels="bgr", threshold=0.1, name="broken")


def perceive(network, frame, *, tracks=False, **settings):
    looks = TrackingDetector([network], network) if tracks else WholeFrameDetector(network)
    return Perceiver(looks, PerceptionConfig(**settings)).perceive(frame, FilterState.initial((1.0, 2.0, 3.0)))


def is_nobody(estimate):
    return (
        np.isnan(estimate.keypoints).all()
        and np.isnan(estimate.points).all()
        and not any(getattr(estimate, name).any() for name in ("mass", "height", "distance", "quality"))
        and not estimate.filter.seen.any()
        and (estimate.filter.mean == (1.0, 2.0, 3.0)).all()
        and weighted_uncertainty(estimate.quality) == 10.0
    )


def is_sound(estimate):
    """No number that can't be, and nothing said of joints that were not found."""
    found, located = np.isfinite(estimate.keypoints[:, 0]), np.isfinite(estimate.points[:, 0])
    qualities = np.stack([estimate.mass, estimate.height, estimate.distance, estimate.quality])
    return (
        (found == np.isfinite(estimate.keypoints[:, 1])).all()
        and (located == np.isfinite(estimate.points).all(axis=1)).all()
        and not (located & ~found).any()
        and ((qualities >= 0) & (qualities <= 1)).all()
        and not qualities[:, ~found].any()
        and not estimate.distance[~located].any()
        and np.isfinite(estimate.filter.mean).all()
        and (estimate.filter.seen == located).all()
    )


class TestMapsThatAreNoNumbers:
    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
    @pytest.mark.parametrize("channel", [Joint.NOSE, Joint.LEFT_EAR, 18])
    def test_one_cell_of_a_heatmap_is_enough_for_an_error(self, frame, value, channel):
        output = draw([STANDING])
        output.heatmaps[channel, 29, 39] = value
        with pytest.raises(InvalidOutput, match="heatmaps that are not finite"):
            perceive(gives(output.heatmaps, output.pafs), frame(BLACK))

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
    def test_one_cell_of_a_field_is_enough_for_an_error(self, frame, value):
        output = draw([STANDING])
        output.pafs[37, 0, 0] = value
        with pytest.raises(InvalidOutput, match="part-affinity fields that are not finite"):
            perceive(gives(output.heatmaps, output.pafs), frame(BLACK))

    def test_a_second_look_is_not_forgiven_either(self, frame):
        first = draw([person(20, 14, scale=0.5)])
        engine = Engine(first, NetworkOutput(first.heatmaps * np.float32(np.nan), first.pafs))
        with pytest.raises(InvalidOutput, match="not finite"):
            perceive(network_of(engine), frame(BLACK), tracks=True)
        assert engine.looks == 2

    def test_empty_maps_are_an_error(self, frame):
        empty = gives(np.zeros((19, 0, 0), np.float32), np.zeros((38, 0, 0), np.float32))
        with pytest.raises(InvalidOutput, match="heatmaps that are empty"):
            perceive(empty, frame(BLACK))


class TestMapsOfNobody:
    @pytest.mark.parametrize("value", [0.0, -1.0, 0.05, -1e30])
    def test_show_nobody_when_nothing_stands_in_them(self, frame, value):
        maps = gives(np.full((19, 30, 40), value, np.float32), np.zeros((38, 30, 40), np.float32))
        assert is_nobody(perceive(maps, frame(BLACK)))

    def test_show_nobody_when_they_are_level(self, frame):
        # Each map is one plateau, and its first cell a peak; no field joins them.
        maps = gives(np.full((19, 30, 40), 0.7, np.float32), np.zeros((38, 30, 40), np.float32))
        assert is_nobody(perceive(maps, frame(BLACK)))

    def test_a_map_of_one_cell_shows_nobody(self, frame):
        assert is_nobody(
            perceive(gives(np.ones((19, 1, 1), np.float32), np.ones((38, 1, 1), np.float32)), frame(BLACK))
        )

    @pytest.mark.parametrize("seed", range(5))
    def test_noise_is_taken_for_somebody_or_not_and_gives_no_wrong_number(self, frame, seed):
        rng = np.random.default_rng(seed)
        for spread in (0.1, 0.5, 100.0):
            heatmaps, pafs = (rng.normal(0, spread, (count, 30, 40)).astype(np.float32) for count in (19, 38))
            depth = rng.choice([np.nan, np.inf, -3.0, 0.0, 2.0, 1e30], (480, 640)).astype(np.float32)
            assert is_sound(perceive(gives(heatmaps, pafs), frame(BLACK, depth=depth)))


class TestDepth:
    @pytest.mark.parametrize("depth", [0.0, np.nan, np.inf, -np.inf, -3.0, 1.4, 15.1, 1e38])
    def test_that_nobody_can_stand_at_locates_nobody(self, frame, depth):
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK, depth=depth))
        assert is_sound(estimate)
        assert np.isfinite(estimate.keypoints).all()
        assert np.isnan(estimate.points).all()
        assert not estimate.filter.seen.any()
        assert estimate.quality == pytest.approx((estimate.mass + estimate.height) / 3)

    @pytest.mark.parametrize("lifting", ["mean", "median", "nearest"])
    @pytest.mark.parametrize("wrong", [0.0, np.nan, np.inf, -np.inf, -3.0])
    def test_is_read_where_it_is_sound(self, frame, wrong, lifting):
        depth = np.full((480, 640), 4.0, np.float32)
        depth[::2] = wrong
        estimate = perceive(DrawnNetwork(STANDING), frame(BLACK, depth=depth), lifting=lifting)
        assert estimate.points[:, 0] == pytest.approx(np.full(18, 4.0))


class TestBorder:
    @pytest.mark.parametrize("corner", [(0, 0), (39, 0), (0, 29), (39, 29)])
    @pytest.mark.parametrize("tracks", [False, True])
    def test_joints_in_the_outermost_cells_stay_in_the_picture(self, frame, corner, tracks):
        joints = person(20, 14)
        joints[[Joint.RIGHT_WRIST, Joint.LEFT_ANKLE]] = corner, (39 - corner[0], 29 - corner[1])
        estimate = perceive(DrawnNetwork(joints), frame(BLACK), tracks=tracks)
        assert is_sound(estimate)
        x, y = estimate.keypoints[np.isfinite(estimate.keypoints[:, 0])].T
        assert ((x > 0) & (x < 639) & (y > 0) & (y < 479)).all()

    @pytest.mark.parametrize("middle", [(0, 14), (39, 14), (20, 0), (20, 29), (0, 0), (39, 29)])
    def test_a_person_half_out_of_the_picture_is_half_seen(self, frame, middle):
        estimate = perceive(DrawnNetwork(person(*middle)), frame(BLACK))
        assert is_sound(estimate)
        assert 0 < np.isfinite(estimate.keypoints[:, 0]).sum() <= 18


@pytest.fixture(scope="module")
def network():
    return open_network(PerceptionConfig())


@pytest.mark.slow
class TestRealNetwork:
    @pytest.mark.parametrize("seed", [None, 0, 1])
    def test_finds_nobody_in_pictures_of_nobody(self, network, frame, seed):
        """Grey, and noise of large and small grain."""
        if seed is None:
            picture = np.full((480, 640, 3), 128, np.uint8)
        else:
            grain = 1 if seed else 16
            noise = np.random.default_rng(seed).integers(0, 256, (480 // grain, 640 // grain, 3), np.uint8)
            picture = np.ascontiguousarray(noise.repeat(grain, axis=0).repeat(grain, axis=1))
        assert is_nobody(perceive(network, frame(picture)))


@pytest.mark.slow
class TestProcess:
    """The same through a socket: a perception worker's process whose network breaks on anything but black."""

    @pytest.fixture
    def addresses(self, tmp_path):
        return f"ipc://{tmp_path}/render", f"ipc://{tmp_path}/perception"

    def test_a_broken_network_is_a_failure_with_a_code_and_the_worker_goes_on(self, addresses, nan_onnx, frame):
        black, white = frame(BLACK), frame(np.full_like(BLACK, 255))
        arguments = ("--bind", addresses[1], "--render", addresses[0], "--network", nan_onnx)
        with (
            serving({Render: lambda request: black}, addresses[0], role=Role.RENDER),
            running("perception_worker", *arguments),
            Client(addresses[1], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
        ):
            looks = [Perceive(frame=one, filter=FilterState.initial((1.0, 2.0, 3.0))) for one in (black, white)]
            assert is_nobody(client.call(looks[0]))
            with pytest.raises(Rejected, match="not finite") as refused:
                client.call(looks[1])
            assert (refused.value.code, refused.value.retryable) == ("invalid-output", False)
            assert is_nobody(client.call(looks[0]))

    def test_a_network_that_is_broken_from_the_start_ends_the_worker_by_its_reason(self, addresses, damaged_onnx):
        arguments = ("--bind", addresses[1], "--render", addresses[0], "--network", damaged_onnx)
        with running("perception_worker", *arguments) as process:
            _, said = process.communicate(timeout=60)
        assert process.returncode == ExitCode.HOPELESS
        assert "not finite" in said.splitlines()[-1]
