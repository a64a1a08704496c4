"""A network for one person: a heatmap for each joint, and no fields to tell people apart.

MoveNet and BlazePose have no neck. Ours is the middle between the shoulders, and its heatmap is made of theirs: both
are moved so that their peaks meet there, and the lower value counts. So the neck's peak is as high as the less sure
shoulder's, and beside the peak it has only what both shoulders' maps have there.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from perception_worker.networks.decoding import find_peaks
from perception_worker.networks.engine import Engine, Shapes
from perception_worker.networks.network import NetworkOutput, People, require_finite, with_background
from perception_worker.networks.pixels import as_image, fitted
from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.config import Pixels
from protocol.errors import InvalidConfig
from protocol.skeleton import COCO_17, JOINT_COUNT, Joint

STRIDE = 4
"""Pixels of a cell, in MoveNet as in BlazePose."""

LEAST_PRESENCE = 0.1
"""BlazePose gives a score for the presence of a person; below this its heatmaps count as empty.

Its publisher's 0.5 is meant for a picture of one person alone: a third of our whole frames stay below 0.5, and a fifth
below this. Backgrounds alone reach this in 1 of 109 pictures.
"""

_SHOULDERS = (Joint.RIGHT_SHOULDER, Joint.LEFT_SHOULDER)


@dataclass(frozen=True)
class SinglePersonKind:
    """The properties of one network of this sort.

    Attributes:
        size: rows and columns of its input; it takes no other.
        channels: that its heatmaps have.
        channel_of: which of them is each joint's; the neck has none.
        logits: whether its heatmaps have yet to be brought into [0, 1].
        presence: whether it also gives a score for the presence of a person.
        threshold: height that a peak must exceed, where the configuration names none.
    """

    size: tuple[int, int]
    pixels: Pixels
    channels: int
    channel_of: Mapping[Joint, int]
    threshold: float
    logits: bool = False
    presence: bool = False


_MOVENET_CHANNELS = {joint: channel for channel, joint in enumerate(COCO_17)}
# Of BlazePose's 33 landmarks: the middles of the eyes rather than their corners, and no hands, feet or mouth.
_LANDMARKS = (0, 2, 5, 7, 8, *range(11, 17), *range(23, 29))
_BLAZEPOSE_CHANNELS: dict[Joint, int] = dict(zip(COCO_17, _LANDMARKS, strict=True))

MOVENET_LIGHTNING = SinglePersonKind(
    (192, 192), pixels="rgb_signed", channels=17, channel_of=_MOVENET_CHANNELS, threshold=0.2
)
MOVENET_THUNDER = SinglePersonKind(
    (256, 256), pixels="rgb_signed", channels=17, channel_of=_MOVENET_CHANNELS, threshold=0.2
)
BLAZEPOSE = SinglePersonKind(
    (256, 256),
    pixels="rgb_unit",
    channels=39,
    channel_of=_BLAZEPOSE_CHANNELS,
    threshold=0.3,
    logits=True,
    presence=True,
)


class SinglePersonNetwork:
    """Takes a picture fitted into its size with black beside it; each joint is at the highest peak of its heatmap."""

    def __init__(self, engine: Engine, kind: SinglePersonKind, *, threshold: float, name: str) -> None:
        """Make sure that the network has the outputs of its kind.

        Raises:
            InvalidConfig: it has other outputs.
        """
        self.input_size = engine.input_size
        self._engine = engine
        self._kind = kind
        self._threshold = threshold
        self._name = name
        _require_outputs(engine.outputs, kind, name)

    def infer(self, rgb: UInt8Array) -> NetworkOutput:
        """Run the network on an image (rows, columns, 3) of any size, RGB.

        Raises:
            InvalidOutput: it gave heatmaps that are empty or not finite.
        """
        picture, placement = fitted(rgb, self.input_size, STRIDE)
        outputs = self._engine.run(as_image(picture, self._kind.pixels))
        for values in outputs.values():
            require_finite(values, self._name)
        heatmaps = placement.cut(outputs["heatmaps"])
        joints = np.zeros((JOINT_COUNT, *heatmaps.shape[1:]), np.float32)
        if not self._kind.presence or outputs["presence"].item() >= LEAST_PRESENCE:
            chosen = heatmaps[list(self._kind.channel_of.values())]
            joints[list(self._kind.channel_of)] = _sigmoid(chosen) if self._kind.logits else chosen
            joints[Joint.NECK] = neck_map(joints)
        return NetworkOutput(with_background(joints), np.zeros((0, *heatmaps.shape[1:]), np.float32))

    def decode(self, output: NetworkOutput) -> People:
        """One person; the network does not tell other people in the picture apart."""
        keypoints = highest_peaks(output.heatmaps, self._threshold)
        keypoints[Joint.NECK] = keypoints[list(_SHOULDERS)].mean(axis=0)
        return People(keypoints, np.empty((0, JOINT_COUNT, 2)))


def highest_peaks(heatmaps: Float32Array, threshold: float) -> Float64Array:
    """(18, 2) column and row of the highest peak of each joint's map, NaN where none exceeds the threshold."""
    peaks = find_peaks(heatmaps, threshold)
    joints, first = np.unique(peaks.joint, return_index=True)
    keypoints = np.full((JOINT_COUNT, 2), np.nan)
    keypoints[joints] = peaks.position[first]
    return keypoints


def neck_map(joints: Float32Array) -> Float32Array:
    """(rows, columns) the neck's heatmap, of the shoulders' in (18, rows, columns)."""
    shoulders = highest_peaks(joints, 0.0)[list(_SHOULDERS)]
    if not np.isfinite(shoulders).all():
        return np.zeros(joints.shape[1:], joints.dtype)
    neck = np.rint(shoulders.mean(axis=0)).astype(int)
    maps = [joints[joint] for joint in _SHOULDERS]
    peaks = [np.unravel_index(each.argmax(), each.shape) for each in maps]
    moved = [
        _moved(each, int(neck[1] - row), int(neck[0] - column)) for each, (row, column) in zip(maps, peaks, strict=True)
    ]
    return np.minimum(*moved)


def _moved(heatmap: Float32Array, down: int, right: int) -> Float32Array:
    """A map moved by whole cells, with 0 beyond its borders."""
    rows, columns = heatmap.shape
    moved = np.zeros_like(heatmap)
    moved[max(down, 0) : rows + min(down, 0), max(right, 0) : columns + min(right, 0)] = heatmap[
        max(-down, 0) : rows - max(down, 0), max(-right, 0) : columns - max(right, 0)
    ]
    return moved


def _sigmoid(logits: Float32Array) -> Float32Array:
    # BlazePose's logits go down to -50, where exp is finite in float32 yet.
    return np.float32(1) / (np.float32(1) + np.exp(-np.maximum(logits, np.float32(-80))))


def _require_outputs(found: Shapes, kind: SinglePersonKind, name: str) -> None:
    expected = {"heatmaps": (kind.channels, kind.size[0] // STRIDE, kind.size[1] // STRIDE)}
    if kind.presence:
        expected["presence"] = (1, 1, 1)
    if dict(found) != expected:
        raise InvalidConfig(f"perception.network: {name} gives {dict(found)}, not {expected}")
