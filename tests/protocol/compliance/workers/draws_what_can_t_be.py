"""Draws something for every scene, also for an impossible one."""

import numpy as np
from proper_worker import ProperWorker, run

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.errors import ImpossibleValue
from protocol.frame import Frame

CAMERA = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(32, 24, 70.0))
PICTURE = Frame(rgb=np.zeros((24, 32, 3), np.uint8), depth=np.ones((24, 32), np.float32), camera=CAMERA)


class DrawsWhatCantBe(ProperWorker):
    def told(self, error):
        return PICTURE if isinstance(error, ImpossibleValue) else super().told(error)


run(DrawsWhatCantBe)
