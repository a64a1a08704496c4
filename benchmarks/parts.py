"""Parts of pictures compared with the whole picture, to the byte, and their cost.

    python -m benchmarks.parts --views 500

Draws random views of train and test scenes by random cameras, each whole and a random part of it in turn, with both
kinds of depth noise, and compares every byte and the truth. Then times parts around a person 2.5 m away. Prints
Markdown tables.
"""

import argparse
import math
import statistics
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from typing import get_args

import cv2
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from benchmarks.machine import machine_kind
from protocol.camera import Camera, CameraPose, DepthNoise, Intrinsics
from protocol.config import RenderConfig
from protocol.frame import Frame
from protocol.messages import Render
from protocol.region import Region
from protocol.scene import Scene
from render_worker.renderer import Renderer, open_renderer
from render_worker.scenes import sample_scene

SIZES = ((640, 480), (320, 240), (848, 480), (161, 97), (33, 17))
NOISES: tuple[DepthNoise, ...] = get_args(DepthNoise)
SIDES = (240, 300, 360, 420)
"""Pixels, of the regions that are timed."""


class Pair(Struct, frozen=True):
    """A picture drawn whole and in part: whether they are the same, and the seconds of each."""

    same_bytes: bool
    same_truth: bool
    whole: float
    part: float


def random_requests(views: int, noise: DepthNoise) -> Iterator[Render]:
    """Parts of views from 0.5 to 9 m away; every tenth is all of the picture, every tenth one pixel."""
    rng = np.random.default_rng(0)
    for number in range(views):
        scene = sample_scene(number // 2, "train" if number % 4 < 2 else "test", int(rng.choice((0, 0, 1, 3))))
        width, height = SIZES[rng.integers(len(SIZES))]
        intrinsics = Intrinsics.from_horizontal_fov(width, height, float(rng.uniform(40, 100)))
        camera = around(scene, rng.uniform(0.5, 9), rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 3), intrinsics)
        left, top = int(rng.integers(width)), int(rng.integers(height))
        region = Region(left, top, int(rng.integers(width - left)) + 1, int(rng.integers(height - top)) + 1)
        kept = {0: Region.seen_by(intrinsics), 1: Region(left, top, 1, 1)}.get(number % 10, region)
        yield Render(scene=scene, camera=replace(camera, depth_noise=noise), truth=number % 3 > 0, region=kept)


def around(scene: Scene, distance: float, azimuth: float, altitude: float, intrinsics: Intrinsics) -> Camera:
    """A camera that looks at the person's middle; metres and radians."""
    x, y = scene.position
    eye = (x + distance * math.cos(azimuth), y + distance * math.sin(azimuth), float(altitude))
    return Camera(CameraPose(eye, (x, y, 1.0)), intrinsics)


def training_requests(count: int, side: int, noise: DepthNoise) -> Iterator[Render]:
    """Views by the drone's camera, 2.5 m from the person and 1 to 2.5 m high, ten of each scene."""
    rng, intrinsics = np.random.default_rng(1), Intrinsics.from_horizontal_fov(640, 480, 70.0)
    middle = Region((intrinsics.width - side) // 2, (intrinsics.height - side) // 2, side, side)
    for number in range(count):
        scene = sample_scene(number // 10, "train")
        camera = around(scene, 2.5, rng.uniform(-np.pi, np.pi), rng.uniform(1.0, 2.5), intrinsics)
        yield Render(scene=scene, camera=replace(camera, depth_noise=noise), region=middle)


def compared(renderer: Renderer, requests: Iterable[Render]) -> list[Pair]:
    """Each request whole and in part, in turns; the scene is uploaded before the clock runs."""
    return [_pair(renderer, request) for request in requests]


def _pair(renderer: Renderer, request: Render) -> Pair:
    whole_request = replace(request, region=None)
    _drawn(renderer, whole_request)
    whole, whole_seconds = _timed(renderer, whole_request)
    part, part_seconds = _timed(renderer, request)
    cut = whole.part(request.region or whole.area)
    same_bytes = cut.rgb.tobytes() == part.rgb.tobytes() and cut.depth.tobytes() == part.depth.tobytes()
    same_bytes = same_bytes and part.region == request.region
    return Pair(same_bytes, _truth(whole) == _truth(part), whole_seconds, part_seconds)


def _truth(frame: Frame) -> tuple[bytes, ...]:
    return tuple(array.tobytes() for array in (frame.joints, frame.visible) if array is not None)


def _timed(renderer: Renderer, request: Render) -> tuple[Frame, float]:
    begun = time.perf_counter()
    frame = _drawn(renderer, request)
    return frame, time.perf_counter() - begun


def _drawn(renderer: Renderer, request: Render) -> Frame:
    return renderer.render(request.scene, request.camera, region=request.region, truth=request.truth)


def row(name: str, pairs: Sequence[Pair]) -> str:
    """The number of equal pairs, and medians in milliseconds."""
    whole, part = (1e3 * statistics.median(getattr(pair, kind) for pair in pairs) for kind in ("whole", "part"))
    ratio = statistics.median(pair.part / pair.whole for pair in pairs)
    same_bytes, same_truth = (sum(getattr(pair, kind) for pair in pairs) for kind in ("same_bytes", "same_truth"))
    counts = f"{len(pairs)} | {same_bytes} | {same_truth}"
    return f"| {name} | {counts} | {whole:.1f} | {part:.1f} | {ratio:.2f} |"


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--views", type=int, default=500, help="random ones for each kind of noise (default: 500)")
    parser.add_argument("--timed", type=int, default=100, help="training views for each size of region (default: 100)")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    console = Console(soft_wrap=True)
    head = (
        "views | same bytes | same truth | whole, ms | part, ms | part to whole |\n|---|---:|---:|---:|---:|---:|---:|"
    )
    with closing(open_renderer(RenderConfig())) as renderer:
        console.print(f"machine: {machine_kind()}\n\n| random parts, depth noise | {head}", markup=False)
        for noise in NOISES:
            console.print(row(noise, compared(renderer, random_requests(options.views, noise))), markup=False)
        console.print(f"\n| 640×480, 2.5 m away | {head}", markup=False)
        for noise in NOISES:
            for side in SIDES:
                pairs = compared(renderer, training_requests(options.timed, side, noise))
                console.print(row(f"{side}×{side}, {noise}", pairs), markup=False)


if __name__ == "__main__":
    main()
