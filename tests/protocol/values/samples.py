"""One message of every kind, with every optional field set, and what they are made of."""

import math

import numpy as np

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.catalogue import Message
from protocol.frame import Frame, Packed
from protocol.messages import (
    Dismiss,
    Dismissed,
    Drain,
    Drained,
    Failure,
    Hello,
    Lookup,
    Observe,
    Perceive,
    Ping,
    Pong,
    Register,
    Registered,
    Render,
    Role,
    Sampled,
    SampleScene,
    State,
    Welcome,
    WorkerRecord,
    Workers,
)
from protocol.pose_estimate import Evidence, FilterState, PoseEstimate, Reading
from protocol.region import Region
from protocol.scene import Arm, BodyPose, Figure, Head, Leg, Scene, Sun, Trunk

CAMERA = Camera(
    CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(8, 6, 70.0), depth_noise="d435i"
)

SCENE = Scene(
    identity=3,
    pose=BodyPose(
        kind=5,
        left_arm=Arm((0.1, 0.2, -0.9), swivel=0.3),
        right_arm=Arm((0.7, -0.2, 0.0)),
        left_leg=Leg(0.1, 0.05, 0.2),
        right_leg=Leg(),
        head=Head(0.1, -0.4),
        trunk=Trunk(0.3, -0.1, 0.2),
    ),
    appearance=7,
    position=(0.5, -0.25),
    yaw=0.75,
    sun=Sun(0.1, 0.8, strength=0.9),
    ground="grass",
    background="sky",
    bystanders=(
        Figure(
            identity=4,
            pose=BodyPose(kind=0, left_arm=Arm((0.0, 0.1, -0.9)), right_arm=Arm((0.0, -0.1, -0.9))),
            appearance=8,
            position=(1.5, 0.5),
            yaw=-2.0,
        ),
    ),
)

RECORD = WorkerRecord(
    role=Role.RENDER,
    address="ipc:///run/render-1",
    incarnation="0011223344556677",
    state=State.READY,
    name="render-1",
    pid=4711,
    key="rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7",
)


def picture(camera: Camera = CAMERA) -> Frame:
    """A frame whose every element tells its place."""
    height, width = camera.intrinsics.height, camera.intrinsics.width
    depth = np.arange(height * width, dtype=np.float32).reshape(height, width)
    depth[0, 0] = np.nan
    return Frame(
        rgb=(np.arange(height * width * 3) % 256).astype(np.uint8).reshape(height, width, 3),
        depth=depth,
        camera=camera,
        joints=np.linspace(-1.0, 1.0, 54).reshape(18, 3),
        visible=np.arange(18) % 2 == 0,
        timings={"render": 0.25},
    )


def packed_picture() -> Frame:
    """A frame that was made smaller for its way; its bytes have not been checked to be a picture."""
    return Frame(
        rgb=np.zeros((0, 0, 3), np.uint8),
        depth=np.zeros((0, 0), np.float32),
        camera=CAMERA,
        packed=Packed(encoding="jpeg", rgb=np.arange(9, dtype=np.uint8), depth=np.arange(5, dtype=np.uint8)),
    )


def part_of_picture() -> Frame:
    """The middle of a frame, alone."""
    return picture().part(Region(left=2, top=1, width=4, height=3))


def observation() -> PoseEstimate:
    """An observation in which some joints were not found."""
    keypoints = np.arange(36, dtype=float).reshape(18, 2)
    keypoints[4] = math.nan
    ramp = np.linspace(0.0, 1.0, 18)
    return PoseEstimate(
        keypoints=keypoints,
        points=np.full((18, 3), math.nan),
        mass=ramp,
        height=ramp / 2,
        distance=1 - ramp,
        quality=ramp**2,
        filter=FilterState.initial((1.0, 2.0, 3.0), "variance"),
        variance=np.full((18, 3), 0.25),
        heatmaps=np.arange(19 * 2 * 3, dtype=np.float32).reshape(19, 2, 3),
        heatmap_area=(1, 0, 6, 4),
        joints=np.zeros((18, 3)),
        visible=np.ones(18, bool),
        timings={"infer": 0.5, "lift": 0.125},
        spread=ramp / 4,
        expected_error=ramp / 8,
        radius=ramp / 3,
        readings={"median": Reading(points=np.ones((18, 3)), distance=ramp / 5, quality=ramp / 6)},
        evidence=Evidence(
            narrow=np.arange(18 * 7, dtype=np.float32).reshape(18, 7), wide=np.full((18, 7), math.nan, np.float32)
        ),
    )


def samples() -> tuple[Message, ...]:
    """One message of every kind."""
    return (
        Hello(oldest_version=1, newest_version=1, role=Role.AGENT, incarnation="0123456789abcdef"),
        Welcome(
            version=1,
            role=Role.RENDER,
            incarnation="0011223344556677",
            capabilities={"renderer": "opengl"},
            heartbeat=0.5,
        ),
        Ping(),
        Pong(
            incarnation="0011223344556677",
            state=State.BUSY,
            progress=12,
            queue_depth=3,
            resident_bytes=2**28,
            malformed=1,
            lacks=(Role.RENDER,),
        ),
        Drain(),
        Drained(),
        Register(worker=RECORD),
        Registered(over=True),
        Lookup(role=Role.RENDER),
        Workers(workers=(RECORD,)),
        Failure(code="overloaded", message="64 requests are in hand already", retryable=True),
        Dismiss(incarnation="0123456789abcdef"),
        Dismissed(),
        SampleScene(seed=2**40, split="test", bystanders=2, poses="wide"),
        Sampled(scene=SCENE),
        Render(scene=SCENE, camera=CAMERA, truth=True, encoding="lossless", region=Region(2, 1, 4, 3)),
        picture(),
        packed_picture(),
        part_of_picture(),
        Perceive(frame=picture(), filter=FilterState.initial(), heatmaps=True, liftings=("median",), evidence=True),
        Observe(
            scene=SCENE,
            camera=CAMERA,
            filter=FilterState.initial(rule="variance"),
            truth=True,
            heatmaps=True,
            liftings=("median", "mean"),
            evidence=True,
        ),
        observation(),
    )
