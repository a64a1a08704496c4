"""Workers in threads of this process and in processes of their own, behind real sockets."""

import os
import subprocess
import sys
from contextlib import contextmanager

from protocol import Timeouts
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.scene import Arm, BodyPose, Scene, Sun

PATIENCE = Timeouts(call=30.0, startup=60.0)

CAMERA = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
SCENE = Scene(
    identity=41,
    pose=BodyPose(kind=0, left_arm=Arm((0.0, 0.2, -0.9)), right_arm=Arm((0.0, -0.2, -0.9))),
    appearance=7,
    position=(0.0, 0.0),
    yaw=0.0,
    sun=Sun(0.1, 0.8),
    ground="grass",
    background="sky",
)


@contextmanager
def running(module, *arguments, **environment):
    """A worker's process; its stderr is a pipe."""
    process = subprocess.Popen(
        [sys.executable, "-m", module, *map(str, arguments)],
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1", **environment},
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.terminate()
        process.communicate(timeout=30)
