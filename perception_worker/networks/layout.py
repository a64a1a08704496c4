"""How a file's outputs hold heatmaps and part-affinity fields, and the way from there to OpenPose's order.

`openpose` is COCO-18 in OpenPose's order, heatmaps with or without the background and 38 fields, x before y; they may
also come as one output, heatmaps first. `trt_pose` is that project's `human_pose.json`: 18 heatmaps in another order
and 42 fields of 21 links, y before x, some of which run the other way.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from perception_worker.networks.decoding import LIMB_FIELDS
from perception_worker.networks.engine import Outputs
from perception_worker.networks.network import HEATMAP_CHANNELS, PAF_CHANNELS, NetworkOutput, with_background
from protocol.arrays import Float32Array
from protocol.config import Layout
from protocol.errors import InvalidConfig
from protocol.skeleton import COCO_17, JOINT_COUNT, Joint

LayoutName: TypeAlias = Literal["openpose", "trt_pose"]

TRT_POSE_JOINTS: tuple[Joint, ...] = (*COCO_17, Joint.NECK)
"""The joint of each channel of heatmaps."""

# Numbers count from 1, as `human_pose.json` has them.
_TRT_POSE_SKELETON = (
    *((16, 14), (14, 12), (17, 15), (15, 13), (12, 13), (6, 8), (7, 9), (8, 10), (9, 11), (2, 3), (1, 2)),
    *((1, 3), (2, 4), (3, 5), (4, 6), (5, 7), (18, 1), (18, 6), (18, 7), (18, 12), (18, 13)),
)
TRT_POSE_LINKS = tuple((TRT_POSE_JOINTS[a - 1], TRT_POSE_JOINTS[b - 1]) for a, b in _TRT_POSE_SKELETON)
"""From which joint to which each pair of fields runs: the y component, then x."""

_TRT_POSE_FIELDS = 2 * len(TRT_POSE_LINKS)


@dataclass(frozen=True)
class FoundLayout:
    """Which outputs are the heatmaps and the fields (the same one, where they come together), and their order."""

    name: LayoutName
    heatmaps: str
    pafs: str

    def arranged(self, outputs: Outputs) -> NetworkOutput:
        """The maps in OpenPose's order, with a background."""
        heatmaps, pafs = outputs[self.heatmaps], outputs[self.pafs]
        if self.heatmaps == self.pafs:
            heatmaps, pafs = heatmaps[:HEATMAP_CHANNELS], pafs[HEATMAP_CHANNELS:]
        if self.name == "trt_pose":
            heatmaps, pafs = _from_trt_pose(heatmaps, pafs)
        return NetworkOutput(heatmaps if len(heatmaps) == HEATMAP_CHANNELS else with_background(heatmaps), pafs)


def find_layout(shapes: Mapping[str, Sequence[int]], file: object, wanted: Layout = "auto") -> FoundLayout:
    """Which layout a network's outputs have, told by their channels.

    Where there are several pairs, as from a network that refines its maps in stages, the last one counts.

    Args:
        shapes: of each output, without the batch's dimension.
        file: where the network comes from.
        wanted: what the configuration says; `auto` takes either.

    Raises:
        InvalidConfig: the network has other outputs, or not those of the layout that is wanted; the message lists them.
    """
    maps = {name: shape for name, shape in shapes.items() if len(shape) == 3}
    by_channels = {shape[0]: name for name, shape in maps.items()}
    for layout, find in _FINDERS.items():
        found = find(by_channels) if wanted in ("auto", layout) else None
        if found is not None and maps[found.heatmaps][1:] == maps[found.pafs][1:]:
            return found
    gives = ", ".join(f"{name} [n, {', '.join(map(str, shape))}]" for name, shape in shapes.items())
    expected = " or ".join(_EXPECTED[layout] for layout in _FINDERS if wanted in ("auto", layout))
    raise InvalidConfig(f"perception.network: {file} gives {gives}; a pose network gives {expected}")


def require_covering(found: FoundLayout, shapes: Mapping[str, Sequence[int]], image: tuple[int, int]) -> None:
    """Make sure that rows of the maps are rows of the image, and that they cover it: a cell is as wide as it is high.

    Args:
        shapes: of each output, without the batch's dimension.
        image: rows and columns that the network is shown.

    Raises:
        InvalidConfig: no cell of one size covers the image in both directions, give or take a cell at its borders.
    """
    _, rows, columns = shapes[found.heatmaps]
    smallest, largest = zip(*(_cell_sizes(*pair) for pair in zip(image, (rows, columns), strict=True)), strict=True)
    if max(smallest) > min(largest):
        raise InvalidConfig(
            f"perception.network: {found.heatmaps} [n, {', '.join(map(str, shapes[found.heatmaps]))}] does not cover "
            f"images of {image[0]}×{image[1]}; maps are [n, maps, rows, columns], their cells as wide as high"
        )


def _cell_sizes(pixels: int, cells: int) -> tuple[float, float]:
    """The smallest and the largest size of `cells` cells along `pixels` pixels, give or take one cell."""
    return pixels / (cells + 1), pixels / (cells - 1) if cells > 1 else float("inf")


def _find_openpose(by_channels: Mapping[int, str]) -> FoundLayout | None:
    for channels in (HEATMAP_CHANNELS, JOINT_COUNT):
        if {channels, PAF_CHANNELS} <= by_channels.keys():
            return FoundLayout("openpose", by_channels[channels], by_channels[PAF_CHANNELS])
    together = by_channels.get(HEATMAP_CHANNELS + PAF_CHANNELS)
    return FoundLayout("openpose", together, together) if together else None


def _find_trt_pose(by_channels: Mapping[int, str]) -> FoundLayout | None:
    if {JOINT_COUNT, _TRT_POSE_FIELDS} <= by_channels.keys():
        return FoundLayout("trt_pose", by_channels[JOINT_COUNT], by_channels[_TRT_POSE_FIELDS])
    return None


_FINDERS: dict[LayoutName, Callable[[Mapping[int, str]], FoundLayout | None]] = {
    "openpose": _find_openpose,
    "trt_pose": _find_trt_pose,
}
_EXPECTED: dict[LayoutName, str] = {
    "openpose": f"heatmaps [n, {HEATMAP_CHANNELS}, h, w] and part-affinity fields [n, {PAF_CHANNELS}, h, w], apart or "
    f"as one [n, {HEATMAP_CHANNELS + PAF_CHANNELS}, h, w] (layout openpose)",
    "trt_pose": f"[n, {JOINT_COUNT}, h, w] and [n, {_TRT_POSE_FIELDS}, h, w] (layout trt_pose)",
}


def _from_trt_pose(heatmaps: Float32Array, fields: Float32Array) -> tuple[Float32Array, Float32Array]:
    pafs = np.empty((PAF_CHANNELS, *fields.shape[1:]), fields.dtype)
    for first, second, channel in LIMB_FIELDS:
        runs_along = (first, second) in TRT_POSE_LINKS
        link = TRT_POSE_LINKS.index((first, second) if runs_along else (second, first))
        xy = fields[[2 * link + 1, 2 * link]]
        pafs[channel : channel + 2] = xy if runs_along else -xy
    return heatmaps[[TRT_POSE_JOINTS.index(joint) for joint in Joint]], pafs
