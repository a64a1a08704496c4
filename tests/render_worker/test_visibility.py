import numpy as np

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.region import Region
from protocol.skeleton import Joint
from render_worker.visibility import flesh_depths, visible_joints, with_joints

CAMERA = Camera(CameraPose((0, 0, 1), (1, 0, 1)), Intrinsics.from_horizontal_fov(64, 48, 70))


def seen(distance: float, surface: float, *, sideways: float = 0.0) -> np.ndarray:
    """All joints at one place, before them a wall."""
    joints = np.tile([distance, sideways, 1.0], (18, 1))
    return visible_joints(joints, np.full((48, 64), surface, np.float32), CAMERA)


def test_a_joint_on_the_surface_is_seen():
    assert seen(3.0, 3.0).all()


def test_a_hip_may_lie_deeper_in_the_body_than_an_eye():
    visible = seen(3.0, 2.9)
    assert visible[Joint.LEFT_HIP]
    assert visible[Joint.RIGHT_SHOULDER]
    assert not visible[Joint.LEFT_EYE]
    assert not visible[Joint.NOSE]


def test_nothing_is_seen_through_a_body():
    assert not seen(3.0, 2.75).any()


def test_what_is_behind_the_camera_or_beside_the_image_is_not_seen():
    assert not seen(-3.0, 3.0).any()
    assert not seen(3.0, 3.0, sideways=5.0).any()


def test_a_thin_limb_before_the_sky_is_seen_even_where_no_pixel_of_it_was_drawn():
    assert seen(3.0, 0.0).all()


def test_a_region_with_the_joints_in_it_tells_as_much_as_the_whole_picture():
    rng = np.random.default_rng(0)
    for _ in range(50):
        joints = np.array([3.0, 0.0, 1.0]) + rng.uniform(-2, 2, (18, 3))
        depth = rng.uniform(1, 5, (48, 64)).astype(np.float32)
        region = with_joints(Region(40, 8, 5, 3), joints, CAMERA)
        assert Region(40, 8, 5, 3).is_within(region)
        cut = visible_joints(joints, region.part(depth), CAMERA, region)
        np.testing.assert_array_equal(cut, visible_joints(joints, depth, CAMERA))


def test_joints_outside_of_the_picture_make_no_region_larger():
    joints = np.tile([-3.0, 0.0, 1.0], (18, 1))
    assert with_joints(Region(40, 8, 5, 3), joints, CAMERA) == Region(40, 8, 5, 3)


def test_no_limit_reaches_through_the_head_or_the_trunk():
    depths = flesh_depths()
    assert depths[[Joint.LEFT_EYE, Joint.RIGHT_EYE, Joint.NOSE]].max() < 0.05
    assert depths.max() < 0.18
