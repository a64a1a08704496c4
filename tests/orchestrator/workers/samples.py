"""Draws scenes; told a number of seconds, it takes them for each."""

import sys
import time

from protocol import serve
from protocol.messages import Role, Sampled, SampleScene
from protocol.scene import Arm, BodyPose, Scene, Sun


def sample(request: SampleScene) -> Sampled:
    time.sleep(float(sys.argv[2]) if len(sys.argv) > 2 else 0.0)
    arm = Arm(wrist=(0.1, 0.0, -0.9))
    pose = BodyPose(kind=request.seed % 8, left_arm=arm, right_arm=arm)
    sun = Sun(azimuth=0.0, elevation=1.0)
    scene = Scene(
        identity=40, pose=pose, appearance=0, position=(0.0, 0.0), yaw=0.0, sun=sun, ground="grass", background="brick"
    )
    return Sampled(scene=scene)


serve(lambda: {SampleScene: sample}, role=Role.RENDER, bind=sys.argv[1])
