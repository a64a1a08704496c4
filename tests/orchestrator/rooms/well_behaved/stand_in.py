"""What the stand-ins share: command lines like the real rooms', and made-up answers."""

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from protocol import Handlers, Timeouts, serve
from protocol.camera import Camera, project
from protocol.config_file import load_config
from protocol.frame import Frame
from protocol.messages import Perceive, Render, Role, Sampled, SampleScene
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Arm, BodyPose, Scene, Sun
from protocol.server.registration_settings import RegistrationSettings
from protocol.system.logs import configure


def worker_options(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("--bind", required=True)
    parser.add_argument("--config", type=Path)
    parser.add_argument("--render", action="append")
    parser.add_argument("--orchestrator")
    parser.add_argument("--name")
    return parser.parse_args(arguments)


def run_worker(role: Role, start: Callable[[], Handlers]) -> None:
    """Serve as the real rooms do."""
    configure(role)
    options = worker_options()
    serve(
        start,
        role=role,
        bind=options.bind,
        timeouts=Timeouts.from_config(load_config(options.config).timeouts) if options.config else Timeouts(),
        registration=RegistrationSettings(options.orchestrator, options.name) if options.orchestrator else None,
    )


def sample(request: SampleScene) -> Sampled:
    arm = Arm(wrist=(0.1, 0.0, -0.9))
    pose = BodyPose(kind=request.seed % 8, left_arm=arm, right_arm=arm)
    sun = Sun(azimuth=0.0, elevation=1.0)
    scene = Scene(
        identity=40, pose=pose, appearance=0, position=(0.0, 0.0), yaw=0.0, sun=sun, ground="grass", background="brick"
    )
    return Sampled(scene=scene)


def standing_joints() -> np.ndarray:
    """(18, 3) joints of somebody who stands at the origin and looks along x."""
    across = [0, 0, -0.2, -0.3, -0.3, 0.2, 0.3, 0.3, -0.1, -0.1, -0.1, 0.1, 0.1, 0.1, -0.04, 0.04, -0.08, 0.08]
    up = [1.6, 1.45, 1.45, 1.2, 0.95, 1.45, 1.2, 0.95, 0.9, 0.5, 0.1, 0.9, 0.5, 0.1, 1.65, 1.65, 1.63, 1.63]
    return np.stack([np.zeros(18), np.array(across, float), np.array(up, float)], axis=1)


def picture(camera: Camera) -> Frame:
    size = (camera.intrinsics.height, camera.intrinsics.width)
    return Frame(
        rgb=np.full((*size, 3), 128, np.uint8),
        depth=np.full(size, 3.0, np.float32),
        camera=camera,
        joints=standing_joints(),
        visible=np.ones(18, bool),
    )


def render(request: Render) -> Frame:
    return picture(request.camera)


def perceive(request: Perceive) -> PoseEstimate:
    joints, quality = standing_joints(), np.full(18, 0.75)
    return PoseEstimate(
        keypoints=project(joints, request.frame.camera)[:, :2],
        points=joints,
        mass=quality,
        height=quality,
        distance=quality,
        quality=quality,
        filter=FilterState.initial(),
        heatmaps=np.zeros((19, 30, 40), np.float32) if request.heatmaps else None,
    )
