"""Workers behind real sockets, in threads of this process."""

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from protocol import Client, Timeouts, serve
from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import Frame
from protocol.messages import Drain, Render, Role, Sampled, SampleScene
from protocol.scene import Arm, BodyPose, Scene, Sun

CAMERA = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(640, 480, 70))
SCENE = Scene(
    identity=3,
    pose=BodyPose(kind=0, left_arm=Arm((0.0, 0.2, -0.9)), right_arm=Arm((0.0, -0.2, -0.9))),
    appearance=7,
    position=(0.0, 0.0),
    yaw=0.0,
    sun=Sun(0.1, 0.8),
    ground="grass",
    background="sky",
)


def render(request: Render) -> Frame:
    size = (request.camera.intrinsics.height, request.camera.intrinsics.width)
    rgb = np.full((*size, 3), request.scene.appearance, np.uint8)
    return Frame(rgb=rgb, depth=np.ones(size, np.float32), camera=request.camera, timings={"render": 0.0})


def sample(request: SampleScene) -> Sampled:
    return Sampled(scene=SCENE)


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    address = f"ipc://{tmp_path}/w"
    worker = threading.Thread(
        target=serve,
        args=(lambda: {Render: render, SampleScene: sample},),
        kwargs={"role": Role.RENDER, "bind": address},
    )
    worker.start()
    yield address
    with Client(address, role=Role.AGENT) as client:
        client.call(Drain())
    worker.join()


def test_a_frame_comes_back_from_a_worker(address: str) -> None:
    with Client(address, role=Role.AGENT, serves=Role.RENDER, timeouts=Timeouts(call=5.0)) as client:
        assert client.wait_ready().role is Role.RENDER
        pending = client.submit(Render(scene=SCENE, camera=CAMERA))
        frame = pending.result()
        assert (frame.rgb == 7).all()
        assert not frame.rgb.flags.writeable
        assert pending.timing.transport > 0
        frames = list(client.map(Render(scene=SCENE, camera=CAMERA) for _ in range(20)))
        assert len(frames) == 20
