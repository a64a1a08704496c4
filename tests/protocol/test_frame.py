import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame

CAMERA = Camera(CameraPose((0.0, -2.0, 1.0), (0.0, 0.0, 1.0)), Intrinsics(32, 24, 20.0, 20.0, 15.5, 11.5))


def test_a_frame_is_as_large_as_its_camera_says():
    frame = Frame(rgb=np.zeros((24, 32, 3), np.uint8), depth=np.zeros((24, 32), np.float32), camera=CAMERA)
    assert frame.rgb.shape[:2] == frame.depth.shape


@pytest.mark.parametrize(
    ("rgb", "depth", "named"),
    [((32, 24, 3), (24, 32), "rgb"), ((24, 32), (24, 32), "rgb"), ((24, 32, 3), (24, 31), "depth")],
)
def test_an_image_of_the_wrong_shape_is_named(rgb, depth, named):
    with pytest.raises(ValueError, match=f"{named} has shape"):
        Frame(rgb=np.zeros(rgb, np.uint8), depth=np.zeros(depth, np.float32), camera=CAMERA)


def test_true_joints_are_those_of_the_skeleton():
    with pytest.raises(ValueError, match="joints has shape"):
        Frame(
            rgb=np.zeros((24, 32, 3), np.uint8),
            depth=np.zeros((24, 32), np.float32),
            camera=CAMERA,
            joints=np.zeros((17, 3)),
        )
