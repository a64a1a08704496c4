import numpy as np
import pytest

from perception_worker.networks.decoding import LIMB_FIELDS, decode
from perception_worker.networks.layout import TRT_POSE_JOINTS, TRT_POSE_LINKS, find_layout
from protocol.errors import InvalidConfig
from protocol.skeleton import Joint
from tests.perception_worker.drawn_maps import draw, person

STANDING = person(20, 14)


def shapes(**channels):
    return {name: (count, 30, 40) for name, count in channels.items()}


def as_trt_pose(output):
    """A drawn person's maps in trt_pose's order, its links drawn anew from the joints' places."""
    fields = np.zeros((42, *output.pafs.shape[1:]), np.float32)
    for link, (first, second) in enumerate(TRT_POSE_LINKS):
        for a, b, channel in LIMB_FIELDS:
            if {a, b} == {first, second}:
                x, y = output.pafs[channel : channel + 2] * (1 if (a, b) == (first, second) else -1)
                fields[2 * link : 2 * link + 2] = y, x
    return {"cmap": output.heatmaps[list(TRT_POSE_JOINTS)], "paf": fields}


class TestOpenPose:
    def test_is_told_by_channels_whatever_the_names(self):
        found = find_layout(shapes(a=38, b=19) | {"c": (1,)}, "x.onnx")
        assert (found.name, found.heatmaps, found.pafs) == ("openpose", "b", "a")

    def test_passes_maps_on_as_they_are(self):
        output = draw([STANDING])
        arranged = find_layout(shapes(a=19, b=38), "x").arranged({"a": output.heatmaps, "b": output.pafs})
        assert (arranged.heatmaps == output.heatmaps).all()
        assert (arranged.pafs == output.pafs).all()

    def test_may_come_in_one_output_heatmaps_first(self):
        output = draw([STANDING])
        together = np.concatenate([output.heatmaps, output.pafs])
        arranged = find_layout(shapes(maps=57), "x").arranged({"maps": together})
        assert (arranged.heatmaps == output.heatmaps).all()
        assert (arranged.pafs == output.pafs).all()

    def test_without_a_background_is_given_one(self):
        output = draw([STANDING])
        arranged = find_layout(shapes(a=18, b=38), "x").arranged({"a": output.heatmaps[:18], "b": output.pafs})
        assert arranged.heatmaps == pytest.approx(output.heatmaps, abs=1e-6)

    def test_takes_the_last_stage_of_a_network_that_refines_its_maps(self):
        found = find_layout(shapes(first=19, fields=38, second=19, finer=38), "x")
        assert (found.heatmaps, found.pafs) == ("second", "finer")


class TestTrtPose:
    def test_is_told_by_channels(self):
        found = find_layout(shapes(paf=42, cmap=18), "x")
        assert (found.name, found.heatmaps, found.pafs) == ("trt_pose", "cmap", "paf")

    def test_person_is_the_same_as_in_openpose_s_order(self):
        output = draw([STANDING])
        arranged = find_layout(shapes(paf=42, cmap=18), "x").arranged(as_trt_pose(output))
        assert arranged.heatmaps == pytest.approx(output.heatmaps, abs=1e-6)
        assert arranged.pafs == pytest.approx(output.pafs)
        assert decode(arranged, 0.1).person == pytest.approx(STANDING, abs=1 / 6)

    def test_field_from_ankle_to_knee_is_turned_round_and_has_y_first(self):
        # The first link runs from the left ankle, 16 in human_pose.json, to the left knee, 14: here it points up.
        fields = np.zeros((42, 30, 40), np.float32)
        fields[0] = -1
        arranged = find_layout(shapes(paf=42, cmap=18), "x").arranged(
            {"cmap": np.zeros((18, 30, 40), np.float32), "paf": fields}
        )
        channel = next(field for a, b, field in LIMB_FIELDS if (a, b) == (Joint.LEFT_KNEE, Joint.LEFT_ANKLE))
        assert (arranged.pafs[channel + 1] == 1).all()
        assert not np.delete(arranged.pafs, channel + 1, axis=0).any()


class TestOtherOutputs:
    @pytest.mark.parametrize(
        "outputs",
        [
            shapes(logits=3),
            shapes(body_25=78),
            shapes(heatmaps=19),
            shapes(pafs=38),
            shapes(cmap=18),
            {"heatmaps": (19, 30, 40), "pafs": (38, 60, 80)},
            {"heatmaps": (19,), "pafs": (38,)},
            {},
        ],
    )
    def test_are_refused(self, outputs):
        with pytest.raises(InvalidConfig, match=r"x\.onnx gives .*heatmaps \[n, 19, h, w\].*\[n, 18, h, w\] and"):
            find_layout(outputs, "x.onnx")

    @pytest.mark.parametrize(
        ("outputs", "wanted"), [({"a": 19, "b": 38}, "trt_pose"), ({"a": 18, "b": 42}, "openpose")]
    )
    def test_of_the_layout_that_is_not_wanted_are_refused(self, outputs, wanted):
        with pytest.raises(InvalidConfig, match=rf"layout {wanted}"):
            find_layout(shapes(**outputs), "x", wanted)
