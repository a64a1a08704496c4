"""An agent's look at a person through both workers: `look.py KEY ORCHESTRATOR`; prints how many joints it saw."""

import sys
from pathlib import Path

import numpy as np

from agent.connections import Connections, WorkerAccess
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import RunConfig
from protocol.messages import Observe, SampleScene
from protocol.pose_estimate import FilterState
from protocol.security import Security, load_credentials
from protocol.server.registration_settings import RegistrationSettings

workers = WorkerAccess(
    registration=RegistrationSettings(sys.argv[2], "agent"), security=Security(load_credentials(Path(sys.argv[1])))
)
with Connections(RunConfig(), workers, lambda: None) as connections:
    connections.wait_ready()
    scene = connections._render.call(SampleScene(seed=4, split="test")).scene
    x, y = scene.position
    front = (x + 2.5 * np.cos(scene.yaw), y + 2.5 * np.sin(scene.yaw), 1.6)
    camera = Camera(CameraPose(tuple(map(float, front)), (x, y, 1.2)), Intrinsics.from_horizontal_fov(640, 480, 70.0))
    seen = connections._perception.call(Observe(scene=scene, camera=camera, filter=FilterState.initial()))
    sys.stdout.write(str(np.isfinite(seen.keypoints[:, 0]).sum()))
