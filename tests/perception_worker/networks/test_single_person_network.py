import numpy as np
import pytest

from perception_worker.networks.single_person_network import (
    BLAZEPOSE,
    MOVENET_LIGHTNING,
    MOVENET_THUNDER,
    SinglePersonNetwork,
    neck_map,
)
from perception_worker.qoe import quality_of_estimation
from protocol.errors import InvalidConfig, InvalidOutput
from protocol.skeleton import Joint

PICTURE = np.zeros((480, 640, 3), np.uint8)
SQUARE = np.zeros((100, 100, 3), np.uint8)

COCO_17 = (
    *("nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow"),
    *("right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle"),
    "right_ankle",
)
"""MoveNet's joints in its own order, as its publisher lists them."""

LANDMARKS = {"nose": 0, "left_eye": 2, "right_eye": 5, "left_ear": 7, "right_ear": 8}
LANDMARKS |= {name: 11 + place for place, name in enumerate(COCO_17[5:11])}
LANDMARKS |= {name: 23 + place for place, name in enumerate(COCO_17[11:])}
"""BlazePose's landmarks that are joints of COCO, as its publisher numbers them."""


class Gives:
    """An engine that gives the same maps for every picture."""

    def __init__(self, **outputs):
        self._outputs = outputs
        self.outputs = {name: values.shape for name, values in outputs.items()}
        side = outputs["heatmaps"].shape[1] * 4
        self.input_size = side, side
        self.seen = None

    def run(self, image):
        self.seen = image
        return self._outputs


def spot(maps, channel, column, row, height):
    """A peak with a quarter of its height beside it."""
    maps[channel, row - 1 : row + 2, column - 1 : column + 2] = height / 4
    maps[channel, row, column] = height


def movenet(peaks, kind=MOVENET_LIGHTNING):
    maps = np.zeros((17, kind.size[0] // 4, kind.size[1] // 4), np.float32)
    for name, place in peaks.items():
        spot(maps, COCO_17.index(name), *place)
    engine = Gives(heatmaps=maps)
    return SinglePersonNetwork(engine, kind, threshold=kind.threshold, name="drawn"), engine


def seen(network, picture=SQUARE):
    output = network.infer(picture)
    people = network.decode(output)
    assert len(people.others) == 0
    return output, people.person


class TestMoveNet:
    @pytest.mark.parametrize("kind", [MOVENET_LIGHTNING, MOVENET_THUNDER])
    def test_joints_are_given_their_own_names(self, kind):
        places = {name: (2 + 2 * number, 40 - number, 0.8) for number, name in enumerate(COCO_17)}
        _, keypoints = seen(movenet(places, kind)[0])
        for name, (column, row, _) in places.items():
            assert keypoints[Joint[name.upper()]] == pytest.approx([column, row])

    def test_joints_must_exceed_the_threshold(self):
        _, keypoints = seen(movenet({"nose": (20, 9, 0.19), "left_eye": (22, 7, 0.21)})[0])
        assert np.isnan(keypoints[Joint.NOSE]).all()
        assert keypoints[Joint.LEFT_EYE] == pytest.approx([22, 7])

    def test_of_two_peaks_the_higher_counts(self):
        network, engine = movenet({"nose": (20, 9, 0.5)})
        spot(engine._outputs["heatmaps"], 0, 30, 20, 0.6)
        assert seen(network)[1][Joint.NOSE] == pytest.approx([30, 20])

    def test_has_no_fields(self):
        assert seen(movenet({})[0])[0].pafs.shape[0] == 0

    def test_background_is_what_no_joint_is(self):
        output, _ = seen(movenet({"nose": (20, 9, 0.75)})[0])
        assert output.heatmaps.shape == (19, 48, 48)
        assert output.heatmaps[18, 9, 20] == pytest.approx(0.25)
        assert output.heatmaps[18, 40, 40] == 1

    def test_an_empty_map_has_nobody(self):
        assert np.isnan(seen(movenet({})[0])[1]).all()


class TestPicture:
    def test_is_shown_whole_with_black_beside_it_and_in_the_network_s_scale(self):
        network, engine = movenet({})
        network.infer(np.full_like(PICTURE, 255))
        assert engine.seen.shape == (3, 192, 192)
        assert (engine.seen[:, 24:168] == 1).all()
        assert (engine.seen[:, :24] == -1).all()
        assert (engine.seen[:, 168:] == -1).all()

    def test_maps_cover_the_picture_and_nothing_else(self):
        # 640×480 is 192×144 in the network's 192×192, which are 48×36 of its cells, six rows from the top.
        output, keypoints = seen(movenet({"nose": (20, 15, 0.8)})[0], PICTURE)
        assert output.heatmaps.shape == (19, 36, 48)
        assert keypoints[Joint.NOSE] == pytest.approx([20, 9])

    def test_a_peak_in_the_black_is_nobody_s(self):
        assert np.isnan(seen(movenet({"nose": (20, 3, 0.8)})[0], PICTURE)[1]).all()


class TestNeck:
    def test_is_the_middle_of_the_shoulders(self):
        _, keypoints = seen(movenet({"left_shoulder": (30, 12, 0.8), "right_shoulder": (20, 14, 0.6)})[0])
        assert keypoints[Joint.NECK] == pytest.approx([25, 13])

    def test_may_lie_between_two_cells(self):
        _, keypoints = seen(movenet({"left_shoulder": (30, 12, 0.8), "right_shoulder": (21, 13, 0.6)})[0])
        assert keypoints[Joint.NECK] == pytest.approx([25.5, 12.5])

    @pytest.mark.parametrize("shoulder", ["left_shoulder", "right_shoulder"])
    def test_is_not_detected_with_one_shoulder(self, shoulder):
        output, keypoints = seen(movenet({shoulder: (30, 12, 0.8)})[0])
        assert np.isnan(keypoints[Joint.NECK]).all()
        assert not output.heatmaps[Joint.NECK].any()

    def test_is_as_sure_as_the_less_sure_shoulder(self):
        output, _ = seen(movenet({"left_shoulder": (30, 12, 0.8), "right_shoulder": (20, 14, 0.6)})[0])
        neck = output.heatmaps[Joint.NECK]
        assert neck[13, 25] == neck.max() == pytest.approx(0.6)
        assert neck[12:15, 24:27].sum() == pytest.approx(0.6 + 8 * 0.15)
        assert neck.sum() == pytest.approx(neck[12:15, 24:27].sum())

    def test_quality_is_read_at_its_peak(self):
        shoulders = {"left_shoulder": (31, 12, 0.8), "right_shoulder": (20, 13, 0.8)}
        output, keypoints = seen(movenet(shoulders)[0])
        cells = np.full((18, 2), -1)
        cells[Joint.NECK] = np.rint(keypoints[Joint.NECK][::-1])
        quality = quality_of_estimation(output.heatmaps, cells, np.full((18, 3), np.nan))
        assert quality.height[Joint.NECK] == pytest.approx(0.8)
        assert quality.mass[Joint.NECK] == pytest.approx(1.0)

    def test_what_is_far_from_one_shoulder_s_peak_does_not_count(self):
        joints = np.zeros((18, 20, 20), np.float32)
        spot(joints, Joint.LEFT_SHOULDER, 12, 10, 0.8)
        spot(joints, Joint.RIGHT_SHOULDER, 8, 10, 0.8)
        spot(joints, Joint.RIGHT_SHOULDER, 3, 3, 0.7)
        assert neck_map(joints).sum() == pytest.approx(0.8 + 8 * 0.2)

    def test_at_the_border_brings_in_nothing(self):
        joints = np.zeros((18, 20, 20), np.float32)
        joints[Joint.LEFT_SHOULDER, 0, 0], joints[Joint.RIGHT_SHOULDER, 19, 19] = 1.0, 1.0
        assert neck_map(joints).sum() == pytest.approx(1.0)


class TestBlazePose:
    def blazepose(self, peaks, presence=0.9):
        maps = np.full((39, 64, 64), -9, np.float32)
        for name, (column, row, logit) in peaks.items():
            maps[LANDMARKS[name], row, column] = logit
        engine = Gives(heatmaps=maps, presence=np.full((1, 1, 1), presence, np.float32))
        return SinglePersonNetwork(engine, BLAZEPOSE, threshold=BLAZEPOSE.threshold, name="drawn")

    def test_joints_are_given_their_own_names(self):
        places = {name: (2 + 2 * number, 50 - number, 2.0) for number, name in enumerate(LANDMARKS)}
        _, keypoints = seen(self.blazepose(places))
        for name, (column, row, _) in places.items():
            assert keypoints[Joint[name.upper()]] == pytest.approx([column, row])

    def test_logits_become_heights(self):
        output, _ = seen(self.blazepose({"nose": (20, 9, 2.0)}))
        assert output.heatmaps[Joint.NOSE, 9, 20] == pytest.approx(1 / (1 + np.exp(-2.0)))
        assert output.heatmaps[Joint.NOSE, 0, 0] == pytest.approx(1 / (1 + np.exp(9.0)), rel=1e-4)

    def test_where_it_says_that_nobody_is_there_are_no_heatmaps(self):
        output, keypoints = seen(self.blazepose({"nose": (20, 9, 2.0)}, presence=0.09))
        assert np.isnan(keypoints).all()
        assert not output.heatmaps[:18].any()


class TestUnusable:
    def test_outputs_are_refused_by_naming_them(self):
        engine = Gives(heatmaps=np.zeros((16, 48, 48), np.float32))
        with pytest.raises(InvalidConfig, match=r"drawn gives .*\(16, 48, 48\).*not .*\(17, 48, 48\)"):
            SinglePersonNetwork(engine, MOVENET_LIGHTNING, threshold=0.2, name="drawn")

    def test_size_of_maps_is_refused(self):
        engine = Gives(heatmaps=np.zeros((17, 64, 64), np.float32))
        with pytest.raises(InvalidConfig, match="not"):
            SinglePersonNetwork(engine, MOVENET_LIGHTNING, threshold=0.2, name="drawn")

    @pytest.mark.parametrize("value", [np.nan, np.inf])
    def test_heatmaps_that_are_not_finite_are_an_error(self, value):
        network, engine = movenet({"nose": (20, 20, 0.8)})
        engine._outputs["heatmaps"][3, 20, 20] = value
        with pytest.raises(InvalidOutput, match="drawn gave heatmaps that are not finite"):
            network.infer(SQUARE)

    def test_a_presence_that_is_no_number_is_an_error(self):
        engine = Gives(heatmaps=np.zeros((39, 64, 64), np.float32), presence=np.full((1, 1, 1), np.nan, np.float32))
        with pytest.raises(InvalidOutput, match="not finite"):
            SinglePersonNetwork(engine, BLAZEPOSE, threshold=0.3, name="drawn").infer(SQUARE)
