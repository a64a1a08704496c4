import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.experiments.figures.columns import SCHEMA, joint_columns, table_of
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.errors import InvalidInput
from protocol.messages import Observe
from protocol.pose_estimate import FilterState, PoseEstimate, Reading
from protocol.scene import Arm, BodyPose, Scene, Sun

ARM = Arm(wrist=(0.0, 0.0, -0.9))
SCENE = Scene(
    identity=40,
    pose=BodyPose(kind=0, left_arm=ARM, right_arm=ARM),
    appearance=0,
    position=(0.0, 0.0),
    yaw=0.0,
    sun=Sun(azimuth=0.0, elevation=1.0),
    ground="grass",
    background="brick",
)
CAMERA = Camera(CameraPose((3.0, 0.0, 1.0), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
REQUEST = Observe(scene=SCENE, camera=CAMERA, filter=FilterState.initial(), truth=True)
TRUTH = np.tile((0.0, 0.0, 1.0), (18, 1))
FRAME = {
    "frame": 4,
    "seed": 77,
    "identity": 40,
    "pose": 0,
    "poses": "kinds",
    "distance": 3.0,
    "azimuth": 12.0,
    "altitude": 1.0,
    "depth_noise": "d435i",
    "network": "net",
    "lifting": "nearest",
    **dict.fromkeys(("camera_x", "camera_y", "camera_z", "target_x", "target_y", "target_z"), 0.5),
}


def observation() -> PoseEstimate:
    """The nose half a metre off, the neck detected and not located, the rest exact."""
    keypoints, points = np.full((18, 2), 319.5), TRUTH.copy()
    points[0, 1] += 0.5
    points[1] = np.nan
    keypoints[2], points[2] = np.nan, np.nan
    quality = np.linspace(0, 1, 18)
    readings = {
        lifting: Reading(points=points + np.array((shift, 0, 0)), distance=quality, quality=quality / 2)
        for lifting, shift in (("mean", 0.1), ("median", 0.2), ("nearest", 0.0))
    }
    return PoseEstimate(
        keypoints=keypoints,
        points=points,
        mass=quality,
        height=quality,
        distance=quality,
        quality=quality,
        filter=FilterState.initial(),
        joints=TRUTH,
        visible=np.arange(18) != 5,
        spread=np.full(18, 0.3),
        readings=readings,
    )


def rows(observed: PoseEstimate) -> dict[str, np.ndarray]:
    table = table_of([(FRAME, joint_columns(REQUEST, observed))])
    assert table.schema == SCHEMA
    return {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}


def test_each_joint_has_a_row_with_the_values_of_its_frame():
    found = rows(observation())
    assert list(found["joint"]) == list(range(18))
    assert set(found["frame"]) == {4}
    assert (set(found["depth_noise"]), set(found["network"])) == ({"d435i"}, {"net"})
    assert (found["camera_x"][3], found["azimuth"][17]) == (0.5, 12.0)


def test_the_error_is_the_distance_from_the_estimate_to_the_truth_under_each_lifting():
    found = rows(observation())
    assert found["error"][[0, 3]] == pytest.approx([0.5, 0.0])
    assert found["error_mean"][[0, 3]] == pytest.approx([np.hypot(0.5, 0.1), 0.1])
    assert found["error_median"][3] == pytest.approx(0.2)
    assert found["quality_mean"] == pytest.approx(np.linspace(0, 0.5, 18), abs=1e-6)


def test_a_joint_can_be_detected_and_not_located_and_neither():
    found = rows(observation())
    assert list(found["detected"][:4]) == [True, True, False, True]
    assert list(found["located"][:4]) == [True, False, False, True]
    assert np.isnan(found["error"][1:3]).all()
    assert list(found["visible"][4:6]) == [True, False]


def test_the_true_keypoint_is_where_the_camera_sees_the_true_joint():
    found = rows(observation())
    assert found["true_keypoint_x"] == pytest.approx(np.full(18, 319.5))
    assert found["true_keypoint_y"] == pytest.approx(np.full(18, 239.5))


def test_a_worker_that_is_not_calibrated_leaves_nan():
    assert np.isnan(rows(observation())["radius"]).all()
    found = rows(replace(observation(), radius=np.full(18, 0.4), expected_error=np.full(18, 0.2)))
    assert (found["radius"][3], found["expected_error"][3]) == pytest.approx((0.4, 0.2))


@pytest.mark.parametrize("lacks", [{"joints": None}, {"visible": None}, {"readings": {}}])
def test_an_observation_without_what_was_asked_for_is_refused(lacks):
    with pytest.raises(InvalidInput, match="version"):
        joint_columns(REQUEST, replace(observation(), **lacks))


def test_every_column_says_what_it_is():
    assert all(field.metadata[b"description"] for field in SCHEMA)
