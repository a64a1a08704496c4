from pathlib import Path

import cv2
import numpy as np
import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame

PICTURE = Path(__file__).parent / "pictures" / "astronaut.jpg"


@pytest.fixture(scope="session")
def astronaut():
    """A photograph of a person from the waist up, (384, 384, 3) RGB."""
    return np.ascontiguousarray(cv2.imread(str(PICTURE))[..., ::-1])


@pytest.fixture
def frame():
    """An RGB-D frame of any picture and depth; the camera at the origin, 1.5 m high, looks along x."""

    def make(rgb, depth=3.0, **truth):
        height, width = rgb.shape[:2]
        camera = Camera(
            pose=CameraPose(position=(0.0, 0.0, 1.5), target=(3.0, 0.0, 1.5)),
            intrinsics=Intrinsics.from_horizontal_fov(width, height, 70.0),
        )
        depth = np.broadcast_to(np.asarray(depth, np.float32), (height, width))
        return Frame(rgb=rgb, depth=np.ascontiguousarray(depth), camera=camera, **truth)

    return make
