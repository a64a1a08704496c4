"""Messages of every kind and any content that is allowed, and what may become of their parts on the way."""

import math
import struct
from typing import get_args

import msgspec
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.frame import ENCODINGS, Frame, Packed
from protocol.joint_arrays import FARTHEST, MOST_VARIANCE
from protocol.message import Reply, Request
from protocol.messages import (
    MESSAGE_NUMBERS,
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
from protocol.pose_estimate import Evidence, FilterState, Lifting, PoseEstimate, Reading
from protocol.quantities import FARTHEST_IN_SCENE
from protocol.region import Region
from protocol.scene import MOST_BYSTANDERS, Arm, BodyPose, Figure, Head, Leg, Poses, Scene, Sun, Trunk

finite = st.floats(allow_nan=False, allow_infinity=False, width=32)
any_float = st.floats(width=32)
whole = st.integers(-(2**63), 2**63 - 1)
count = st.integers(0, 2**63 - 1)
name = st.text(max_size=20)
timings = st.dictionaries(name, st.floats(-1e9, 1e9), max_size=3)


def floats64(*shape: int):
    return nps.arrays(np.float64, shape, elements=finite | st.just(np.nan), fill=st.just(np.nan))


def bounded64(lowest: float, highest: float, *shape: int):
    return nps.arrays(np.float64, shape, elements=st.floats(lowest, highest))


def floats32(*shape: int):
    return nps.arrays(np.float32, shape, elements=any_float, fill=st.just(np.inf))


flags = nps.arrays(bool, (18,))
joints = st.none() | bounded64(-FARTHEST, FARTHEST, 18, 3)
shares = bounded64(0.0, 1.0, 18)
metres = nps.arrays(np.float64, (18,), elements=st.floats(0.0, 1e300) | st.just(np.nan), fill=st.just(np.nan))
visible = st.none() | flags
away = st.floats(1.0, 100.0)
pixels = st.floats(-1e6, 1e6)
coordinates = st.floats(-FARTHEST_IN_SCENE, FARTHEST_IN_SCENE)
headings = st.floats(-1e6, 1e6)
angles = st.floats(-math.pi, math.pi)
arm_lengths = st.floats(-10.0, 10.0)
seeds = st.integers(0, 2**63 - 1)
pose = st.builds(
    lambda position, x, target: CameraPose((position[0], 0.0, 1.0), (position[0] + x, target, 0.5)),
    st.tuples(st.floats(-10, 10)),
    away,
    st.floats(-10, 10),
)
intrinsics = st.builds(
    Intrinsics,
    width=st.integers(1, 9),
    height=st.integers(1, 9),
    fx=st.floats(0.5, 1e4),
    fy=st.floats(0.5, 1e4),
    cx=pixels,
    cy=pixels,
)
camera = st.builds(Camera, pose, intrinsics, st.sampled_from(["none", "d435i"]))
arm = st.builds(Arm, st.tuples(arm_lengths, arm_lengths, arm_lengths), angles)
leg = st.builds(Leg, angles, angles, angles)
body_pose = st.builds(
    BodyPose,
    st.integers(0, 7),
    arm,
    arm,
    leg,
    leg,
    st.builds(Head, angles, angles),
    st.builds(Trunk, angles, angles, angles),
)
figure = st.builds(
    Figure,
    identity=st.integers(0, 59),
    pose=body_pose,
    appearance=seeds,
    position=st.tuples(coordinates, coordinates),
    yaw=headings,
)
scene = st.builds(
    Scene,
    identity=st.integers(0, 59),
    pose=body_pose,
    appearance=seeds,
    position=st.tuples(coordinates, coordinates),
    yaw=headings,
    sun=st.builds(Sun, headings, st.floats(0.0, math.pi / 2), st.floats(0.0, 10.0)),
    ground=name,
    background=name,
    bystanders=st.lists(figure, max_size=2).map(tuple),
)

filter_state = st.builds(
    FilterState,
    mean=bounded64(-FARTHEST, FARTHEST, 18, 3),
    variance=bounded64(0.0, MOST_VARIANCE, 18, 3),
    process_noise=bounded64(0.0, MOST_VARIANCE, 18),
    seen=flags,
)
role = st.sampled_from(Role)
record = st.builds(
    WorkerRecord, role=role, address=name, incarnation=name, state=st.sampled_from(State), name=name, pid=count
)


@st.composite
def regions(draw: st.DrawFn, height: int, width: int) -> Region:
    """Any part of a picture of that size."""
    rows, columns = draw(st.integers(1, height)), draw(st.integers(1, width))
    return Region(draw(st.integers(0, width - columns)), draw(st.integers(0, height - rows)), columns, rows)


@st.composite
def renders(draw: st.DrawFn) -> Render:
    taken_by = draw(camera)
    return Render(
        scene=draw(scene),
        camera=taken_by,
        truth=draw(st.booleans()),
        encoding=draw(st.sampled_from(ENCODINGS)),
        region=draw(st.none() | regions(taken_by.intrinsics.height, taken_by.intrinsics.width)),
    )


@st.composite
def frames(draw: st.DrawFn) -> Frame:
    taken_by = draw(camera)
    region = draw(st.none() | regions(taken_by.intrinsics.height, taken_by.intrinsics.width))
    size = (region or Region.seen_by(taken_by.intrinsics)).shape
    return Frame(
        rgb=draw(nps.arrays(np.uint8, (*size, 3))),
        depth=draw(floats32(*size)),
        camera=taken_by,
        joints=draw(joints),
        visible=draw(visible),
        timings=draw(timings),
        region=region,
    )


packed = st.builds(
    Packed,
    encoding=st.sampled_from(["lossless", "jpeg"]),
    rgb=nps.arrays(np.uint8, st.integers(0, 9)),
    depth=nps.arrays(np.uint8, st.integers(0, 9)),
)
packed_frames = st.builds(
    Frame,
    rgb=nps.arrays(np.uint8, (0, 0, 3)),
    depth=nps.arrays(np.float32, (0, 0)),
    camera=camera,
    joints=joints,
    visible=visible,
    timings=timings,
    packed=packed,
)

evidence = nps.arrays(np.float32, (18, 7), elements=finite | st.just(np.nan))
lifting = st.sampled_from(get_args(Lifting))
readings = st.builds(Reading, points=floats64(18, 3), distance=shares, quality=shares)

observations = st.builds(
    PoseEstimate,
    keypoints=floats64(18, 2),
    points=floats64(18, 3),
    mass=shares,
    height=shares,
    distance=shares,
    quality=shares,
    filter=filter_state,
    heatmaps=st.none()
    | st.tuples(st.integers(0, 3), st.integers(0, 3)).flatmap(
        lambda size: nps.arrays(np.float32, (19, *size), elements=finite)
    ),
    heatmap_area=st.none() | st.tuples(whole, whole, whole, whole),
    joints=joints,
    visible=visible,
    timings=timings,
    spread=st.none() | metres,
    expected_error=st.none() | metres,
    radius=st.none() | metres,
    readings=st.dictionaries(lifting, readings, max_size=2),
    variance=st.none() | bounded64(0.0, 1e300, 18, 3),
    evidence=st.none() | st.builds(Evidence, narrow=evidence, wide=evidence),
)

MESSAGES: dict[type[Request] | type[Reply], st.SearchStrategy] = {
    Hello: st.builds(Hello, oldest_version=whole, newest_version=whole, role=role, incarnation=name),
    Welcome: st.builds(
        Welcome,
        version=whole,
        role=role,
        incarnation=name,
        capabilities=st.dictionaries(name, name, max_size=3),
        heartbeat=st.floats(0.0, 1e9, exclude_min=True),
    ),
    Ping: st.builds(Ping),
    Pong: st.builds(
        Pong,
        incarnation=name,
        state=st.sampled_from(State),
        progress=count,
        queue_depth=count,
        resident_bytes=count,
        malformed=count,
    ),
    Drain: st.builds(Drain),
    Drained: st.builds(Drained),
    Register: st.builds(Register, worker=record),
    Registered: st.builds(Registered, over=st.booleans()),
    Lookup: st.builds(Lookup, role=role),
    Workers: st.builds(Workers, workers=st.lists(record, max_size=3).map(tuple)),
    Failure: st.builds(Failure, code=name, message=name, retryable=st.booleans()),
    Dismiss: st.builds(Dismiss, incarnation=name),
    Dismissed: st.builds(Dismissed),
    SampleScene: st.builds(
        SampleScene,
        seed=whole,
        split=st.sampled_from(["train", "test"]),
        bystanders=st.integers(0, MOST_BYSTANDERS),
        poses=st.sampled_from(get_args(Poses)),
    ),
    Sampled: st.builds(Sampled, scene=scene),
    Render: renders(),
    Frame: frames() | packed_frames,
    Perceive: st.builds(
        Perceive,
        frame=frames() | packed_frames,
        filter=filter_state,
        heatmaps=st.booleans(),
        liftings=st.lists(lifting, max_size=2).map(tuple),
        evidence=st.booleans(),
    ),
    Observe: st.builds(
        Observe,
        scene=scene,
        camera=camera,
        filter=filter_state,
        truth=st.booleans(),
        heatmaps=st.booleans(),
        liftings=st.lists(lifting, max_size=2).map(tuple),
        evidence=st.booleans(),
    ),
    PoseEstimate: observations,
}

messages = st.one_of([MESSAGES[kind] for kind in MESSAGE_NUMBERS])

anything = st.recursive(
    st.none() | st.booleans() | whole | any_float | name | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(name, inner, max_size=3),
    max_leaves=6,
)
"""Any value that msgpack can encode."""


@st.composite
def spoilt(draw: st.DrawFn, parts: list[bytes]) -> list[bytes]:
    """The parts of a message after one thing went wrong with one of them."""
    parts, place = [*parts], draw(st.integers(0, len(parts) - 1))
    match draw(st.integers(0, 6)):
        case 0:
            del parts[place]
        case 1:
            parts.insert(draw(st.integers(0, len(parts))), parts[place])
        case 2:
            other = draw(st.integers(0, len(parts) - 1))
            parts[place], parts[other] = parts[other], parts[place]
        case 3:
            parts[place] = draw(st.binary(max_size=64))
        case 4:
            parts[0] = struct.pack("<HH", 1, draw(st.sampled_from([*MESSAGE_NUMBERS.values()])))
        case _:
            parts[2] = msgspec.msgpack.encode(draw(misstated(msgspec.msgpack.decode(parts[2]))))
    return parts


@st.composite
def misstated(draw: st.DrawFn, value: object) -> object:
    """The same value, but that something in it, at any depth, is missing or something else."""
    if not isinstance(value, dict | list) or not value or draw(st.booleans()):
        return draw(anything)
    changed = value.copy()
    key = draw(st.sampled_from([*value])) if isinstance(value, dict) else draw(st.integers(0, len(value) - 1))
    if draw(st.integers(0, 3)):
        changed[key] = draw(misstated(value[key]))
    else:
        del changed[key]
    return changed
