"""The frames that a lifter is fitted on, as arrays, and their augmentation."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from perception_worker.lifter.evidence import LEAST, SHARE, median_of_known
from perception_worker.lifter.tokens import Seen
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import CameraPose, world_to_camera
from protocol.errors import InvalidInput
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.skeleton import JOINT_COUNT, MIRRORED, Joint

MOST_AWAY = 0.3
"""Of the body's height in the picture. Keypoints whose median is farther from the true joints are another person's:
nothing of the person can be learned from them."""

USUAL_DISTANCE, MOST_ASIDE, LEAST_FOCAL = (1.5, 9.0), 0.12, 400.0
"""Metres along the ground; the slope from the picture's middle to the person's; pixels per unit of slope."""

LEAST_FOUND = 3
"""Joints of a person that have to be found; with fewer no person is detected; see `perception_worker.detection`."""

RESCALED, SIZES = 0.5, (0.7, 1.3)
"""The share of frames that are shown with people of another size, and how much smaller or larger these are."""

JOINTS_DROPPED, DEPTHS_DROPPED = (0.0, 0.3), (0.0, 0.3)
"""Shares of a frame's joints, and of the depths around them, that are taken away: drawn evenly for each frame that
loses any."""

LOSES_JOINTS, LOSES_DEPTHS, LOSES_ALL_DEPTHS = 0.4, 0.3, 0.02
"""Shares of the frames that do."""

CONFUSED = 0.1
"""The share of the frames in which the ends of two arms, or of two legs, are each taken for the other side's."""

_ENDS = (
    (Joint.LEFT_WRIST,),
    (Joint.LEFT_ELBOW, Joint.LEFT_WRIST),
    (Joint.LEFT_ANKLE,),
    (Joint.LEFT_KNEE, Joint.LEFT_ANKLE),
)


class Frames(Struct, frozen=True, eq=False, kw_only=True):
    """n frames of people whose truth is known.

    Attributes:
        joints: (n, 18, 3) the true ones in the cameras' frames, metres.
        identity: (n,) whose.
        usual: (n,) whether they are like a flight's: alone, in full view, followed by a filter, in one of the kinds of
            pose, as far away as flights go, in the middle of a picture that is as sharp as a flight's.
        wide: (n,) whether they are in poses of the widest ranges.
    """

    seen: Seen
    joints: Float64Array
    identity: NDArray[np.int64]
    usual: BoolArray
    wide: BoolArray

    def __len__(self) -> int:
        return len(self.joints)

    def of(self, chosen: NDArray[np.intp] | BoolArray) -> "Frames":
        """Some of them."""
        seen = Seen(**{name: getattr(self.seen, name)[chosen] for name in self.seen.__struct_fields__})
        rest = {name: getattr(self, name)[chosen] for name in self.__struct_fields__ if name != "seen"}
        return Frames(seen=seen, **rest)


def read_frames(path: Path) -> Frames:
    """The frames of a table in which the person was found.

    Raises:
        InvalidInput: it is no table of `orchestrator lifter fit`.
    """
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InvalidInput(f"{path} is no table of views: {error}") from error
    lacking = {"keypoints", "narrow", "wide", "joints", "intrinsics", "pose"} - set(table.column_names)
    if lacking or table.num_rows == 0:
        raise InvalidInput(f"{path} is no table of 'orchestrator lifter fit'")
    frames = _frames(table)
    found = np.isfinite(frames.seen.rays[:, :, 0]).sum(axis=1)
    frames = frames.of(found >= LEAST_FOUND)
    return frames.of(_away(frames) <= MOST_AWAY)


def made_harder(seen: Seen, random: np.random.Generator) -> Seen:
    """The frames with some joints and depths removed, as if they were not found or not measured."""
    frames = len(seen.rays)
    kept = random.random((frames, JOINT_COUNT)) >= _shares(frames, LOSES_JOINTS, JOINTS_DROPPED, random)
    enough = (kept & np.isfinite(seen.rays[:, :, 0])).sum(axis=1) >= LEAST_FOUND
    kept |= ~enough[:, None]
    measured = random.random((frames, JOINT_COUNT)) >= _shares(frames, LOSES_DEPTHS, DEPTHS_DROPPED, random)
    measured &= (random.random(frames) >= LOSES_ALL_DEPTHS)[:, None]
    return replace(
        seen,
        rays=np.where(kept[:, :, None], seen.rays, np.nan),
        height=np.where(kept, seen.height, 0.0),
        narrow=_without(seen.narrow, kept & measured),
        wide=_without(seen.wide, kept & measured),
    )


def confused(seen: Seen, random: np.random.Generator) -> Seen:
    """The frames with left and right of some limbs exchanged, as a pose network does where limbs cross or hide."""
    frames = len(seen.rays)
    taken = np.tile(np.arange(JOINT_COUNT), (frames, 1))
    drawn = random.integers(len(_ENDS), size=frames)
    chosen = random.random(frames) < CONFUSED
    for number, left in enumerate(_ENDS):
        both = np.array([*left, *MIRRORED[list(left)]])
        taken[np.ix_(chosen & (drawn == number), both)] = MIRRORED[both]
    every = np.arange(frames)[:, None]
    parts = {name: getattr(seen, name)[every, taken] for name in ("rays", "height", "narrow", "wide")}
    return replace(seen, **parts)


def rescaled(frames: Frames, random: np.random.Generator) -> Frames:
    """The frames with people of other sizes as much nearer or farther: the same pictures, with other depths.

    Otherwise a crouching person would be taken for one far away, whatever their depth says.
    """
    smallest, largest = SIZES
    drawn = np.exp(random.uniform(np.log(smallest), np.log(largest), len(frames)))
    size = np.where(random.random(len(frames)) < RESCALED, drawn, 1.0)[:, None, None]
    seen = frames.seen
    narrow, wide = seen.narrow.copy(), seen.wide.copy()
    for evidence in (narrow, wide):
        evidence[:, :, LEAST:] *= size.astype(np.float32)
    return replace(frames, seen=replace(seen, narrow=narrow, wide=wide), joints=frames.joints * size)


def _away(frames: Frames) -> Float64Array:
    """(n,) how far keypoints are from the true joints at the median, as a share of the body's height in the picture."""
    slopes = frames.joints[:, :, :2] / frames.joints[:, :, 2:]
    away = np.linalg.norm(frames.seen.rays - slopes, axis=2)
    return median_of_known(away) / np.ptp(slopes[:, :, 1], axis=1)


def _shares(frames: int, losing: float, bounds: tuple[float, float], random: np.random.Generator) -> Float64Array:
    return (random.uniform(*bounds, frames) * (random.random(frames) < losing))[:, None]


def _without(evidence: NDArray[np.float32], kept: BoolArray) -> NDArray[np.float32]:
    left = np.where(kept[:, :, None], evidence, np.float32(np.nan))
    left[:, :, SHARE] = np.where(kept, evidence[:, :, SHARE], 0.0)
    return left


def _frames(table: pa.Table) -> Frames:
    transforms = _transforms(_lists(table, "pose", 6))
    world = _lists(table, "joints", JOINT_COUNT, 3)
    joints = world @ transforms[:, :3, :3].swapaxes(1, 2) + transforms[:, None, :3, 3]
    seen = _seen(table, transforms)
    return Frames(
        seen=seen,
        joints=joints,
        identity=table["identity"].to_numpy().astype(np.int64),
        usual=_usual(table, joints, seen.focal),
        wide=_is_wide(table),
    )


def _seen(table: pa.Table, transforms: Float64Array) -> Seen:
    fx, fy, cx, cy = _lists(table, "intrinsics", 4).T
    keypoints = _lists(table, "keypoints", JOINT_COUNT, 2)
    narrow, wide = (_lists(table, name, JOINT_COUNT, EVIDENCE_SIZE).astype(np.float32) for name in ("narrow", "wide"))
    return Seen(
        rays=(keypoints - np.stack([cx, cy], axis=1)[:, None]) / np.stack([fx, fy], axis=1)[:, None],
        height=_lists(table, "height", JOINT_COUNT),
        narrow=narrow,
        wide=wide,
        up=transforms[:, 1:3, 2],
        focal=fx,
    )


def _usual(table: pa.Table, joints: Float64Array, focal: Float64Array) -> BoolArray:
    """(n,) whether the views are like a flight's."""
    alone = ~_flag(table, "accompanied") & ~_flag(table, "hidden") & _flag(table, "known") & ~_is_wide(table)
    distance = table["distance"].to_numpy()
    aside = np.abs((joints[:, :, :2] / joints[:, :, 2:]).mean(axis=1)).max(axis=1)
    nearest, farthest = USUAL_DISTANCE
    near = (distance >= nearest) & (distance <= farthest)
    return alone & near & (aside <= MOST_ASIDE) & (focal >= LEAST_FOCAL)


def _is_wide(table: pa.Table) -> BoolArray:
    return np.array(table["poses"].to_pylist()) == "wide"


def _lists(table: pa.Table, name: str, *shape: int) -> Float64Array:
    values = table[name].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return values.astype(np.float64).reshape(table.num_rows, *shape)


def _flag(table: pa.Table, name: str) -> BoolArray:
    return table[name].to_numpy().astype(bool)


def _transforms(poses: Float64Array) -> Float64Array:
    """(n, 4, 4) from the world to each camera, of positions and targets (n, 6)."""
    ends = [(tuple(pose[:3]), tuple(pose[3:])) for pose in poses.tolist()]
    return np.stack([world_to_camera(CameraPose(position, target)) for position, target in ends])
