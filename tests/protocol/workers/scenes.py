"""Scenes that tell which request they answer."""

from protocol.messages import Sampled
from protocol.scene import Arm, BodyPose, Scene, Sun


def scene_for(seed: int) -> Sampled:
    """A scene whose yaw is the seed."""
    pose = BodyPose(kind=0, left_arm=Arm((0.0, 0.2, -0.9)), right_arm=Arm((0.0, -0.2, -0.9)))
    return Sampled(
        scene=Scene(
            identity=0,
            pose=pose,
            appearance=0,
            position=(0.0, 0.0),
            yaw=float(seed),
            sun=Sun(0.0, 1.0),
            ground="grass",
            background="sky",
        )
    )
