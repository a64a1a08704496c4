"""The cost of packing frames: time and size of each way to pack, and its effect on the estimate.

    python -m benchmarks.frames --frames 100

Frames of test identities, 1.5 to 4 m away, the front half, 640×480, with exact depth and with a D435i's. All ways take
turns on each frame. Then the pose is estimated in the unpacked frames. Prints Markdown tables. Ways whose library is
not installed (lz4, qoi: no room needs them) are left out.
"""

import argparse
import importlib
import statistics
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import cv2
import numpy as np
import simplejpeg  # pyright: ignore[reportMissingTypeStubs]
import zstandard
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from benchmarks.estimation.detection import detection, finding
from benchmarks.estimation.viewpoints import front_views, observe_requests
from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import open_display
from orchestrator.pictures.worker_pair import WorkerPair, worker_pair
from protocol.arrays import AnyArray
from protocol.config import RunConfig
from protocol.frame import Frame
from protocol.messages import Observe, Perceive, Render
from protocol.packing.lossless import compress_colours, compress_depth, decompress_colours, decompress_depth
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import weighted_uncertainty
from protocol.system.stop_request import stop_on_signals

QUALITIES = (80, 90, 95)
SUBSAMPLINGS = ("420", "444")
Array = Any
"""Arrays as cv2 and the other libraries take and give them; their stubs lack the types."""


class Way(NamedTuple):
    """A way to pack an array into bytes and to unpack it."""

    pack: Callable[[Array], Any]
    unpack: Callable[[Any], Array]


class Cost(Struct, frozen=True):
    """Medians over all frames: seconds, and bytes; and whether each came back to the bit."""

    pack: float
    unpack: float
    size: float
    largest: int
    exact: bool


def colour_ways(height: int, width: int) -> dict[str, Way]:
    """Ways to pack (height, width, 3) colours."""
    ways = {
        "none": Way(lambda rgb: rgb, lambda data: data),
        "**differences, zstd 1** (`lossless`)": Way(
            compress_colours, partial(decompress_colours, height=height, width=width)
        ),
        "zstd 1": _zstd(1, np.uint8, (height, width, 3)),
        "zstd 3": _zstd(3, np.uint8, (height, width, 3)),
        "PNG, level 1": Way(
            lambda rgb: _written(".png", rgb, cv2.IMWRITE_PNG_COMPRESSION, 1), lambda data: cv2.imdecode(data, 1)
        ),
        "WebP, lossless": Way(
            lambda rgb: _written(".webp", rgb, cv2.IMWRITE_WEBP_QUALITY, 101), lambda data: cv2.imdecode(data, 1)
        ),
    }
    if (qoi := _library("qoi")) is not None:
        ways["QOI"] = Way(qoi.encode, qoi.decode)
    if (lz4 := _library("lz4.block")) is not None:
        ways["lz4"] = _lz4(lz4, np.uint8, (height, width, 3))
    return ways | jpegs()


def jpegs() -> dict[str, Way]:
    """JPEGs, by quality and resolution of colours."""
    return {
        f"JPEG {quality}, {subsampling}": Way(
            partial(simplejpeg.encode_jpeg, quality=quality, colorspace="RGB", colorsubsampling=subsampling),
            partial(simplejpeg.decode_jpeg, colorspace="RGB"),
        )
        for quality in QUALITIES
        for subsampling in SUBSAMPLINGS
    }


def depth_ways(height: int, width: int) -> dict[str, Way]:
    """Ways to pack (height, width) depth in metres; the ones in millimetres are not exact."""
    shape = (height, width)
    millimetres = _zstd(1, np.uint16, shape)
    ways = {
        "none": Way(lambda depth: depth, lambda data: data),
        "**zstd 1** (`lossless`, `jpeg`)": Way(compress_depth, partial(decompress_depth, height=height, width=width)),
        "zstd 3": _zstd(3, np.float32, shape),
        "bytes by place, zstd 1": Way(
            lambda depth: _zstd(1, np.uint8, shape).pack(depth.reshape(-1).view(np.uint8).reshape(-1, 4).T.copy()),
            lambda data: (
                np.ascontiguousarray(_zstd(1, np.uint8, (4, height * width)).unpack(data).T)
                .view(np.float32)
                .reshape(shape)
            ),
        ),
        "16-bit millimetres, zstd 1": Way(
            lambda depth: millimetres.pack(to_millimetres(depth)), lambda data: to_metres(millimetres.unpack(data))
        ),
        "16-bit millimetres, PNG": Way(
            lambda depth: _written(".png", to_millimetres(depth), cv2.IMWRITE_PNG_COMPRESSION, 1),
            lambda data: to_metres(cv2.imdecode(data, cv2.IMREAD_UNCHANGED)),
        ),
    }
    if (lz4 := _library("lz4.block")) is not None:
        ways["lz4"] = _lz4(lz4, np.float32, shape)
    return ways


def to_millimetres(depth: Array) -> Array:
    """As a depth camera tells it; 0 where nothing was measured, and beyond 65.5 m."""
    rounded = np.rint(np.nan_to_num(depth) * 1000)
    return np.where(rounded < 2**16, rounded, 0).astype(np.uint16)


def to_metres(millimetres: Array) -> Array:
    """float32 metres."""
    return (millimetres / np.float32(1000)).astype(np.float32)


def _zstd(level: int, dtype: Any, shape: tuple[int, ...]) -> Way:
    return Way(
        lambda array: zstandard.ZstdCompressor(level=level).compress(array.reshape(-1).data.cast("B")),
        lambda data: np.frombuffer(zstandard.ZstdDecompressor().decompress(data), dtype).reshape(shape),
    )


def _lz4(lz4: Any, dtype: Any, shape: tuple[int, ...]) -> Way:
    return Way(
        lambda array: lz4.compress(array.reshape(-1).data.cast("B")),
        lambda data: np.frombuffer(lz4.decompress(data), dtype).reshape(shape),
    )


def _written(ending: str, picture: Array, *options: int) -> Array:
    return cv2.imencode(ending, picture, options)[1]


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def costs(ways: Mapping[str, Way], arrays: Sequence[AnyArray]) -> dict[str, Cost]:
    """The cost of each way; they take turns on each array."""
    tries: dict[str, list[tuple[float, float, int, bool]]] = {name: [] for name in ways}
    for array in arrays:
        for name, way in ways.items():
            begun = time.perf_counter()
            packed = way.pack(array)
            between = time.perf_counter()
            opened = way.unpack(packed)
            ended = time.perf_counter()
            exact = bool(np.asarray(opened).tobytes() == array.tobytes())
            tries[name].append((between - begun, ended - between, memoryview(packed).nbytes, exact))
    return {name: _cost(tried) for name, tried in tries.items()}


def _cost(tries: Iterable[tuple[float, float, int, bool]]) -> Cost:
    pack, unpack, sizes, exact = zip(*tries, strict=True)
    return Cost(
        pack=statistics.median(pack),
        unpack=statistics.median(unpack),
        size=statistics.median(sizes),
        largest=max(sizes),
        exact=all(exact),
    )


def cost_table(what: str, costs: Mapping[str, Cost]) -> str:
    """Milliseconds and kilobytes."""
    whole = costs["none"].size
    columns = ("pack, ms", "open, ms", "kB", "largest, kB", "times smaller", "exact")
    head = f"| {what} | {' | '.join(columns)} |\n|---|---:|---:|---:|---:|---:|---|"
    rows = [
        f"| {name} | {1e3 * cost.pack:.2f} | {1e3 * cost.unpack:.2f} | {cost.size / 1e3:.0f} "
        f"| {cost.largest / 1e3:.0f} | {whole / cost.size:.1f} | {'yes' if cost.exact else 'no'} |"
        for name, cost in costs.items()
    ]
    return "\n".join([head, *rows])


class Effect(Struct, frozen=True):
    """The effect of a change to frames on the estimates, over all frames and joints.

    Attributes:
        shift: quantiles 0.5, 0.95 and 1 of how far keypoints move, in pixels.
        lost, gained: share of the joints detected without the change, and besides them.
        point_shift: median and 0.95 quantile of how far points in space move, in metres.
        quality: mean and 0.95 quantile of the change of a joint's quality of estimation, in [0, 1].
        uncertainty: mean change of the weighted uncertainty (0 to 10), without its sign, and with it.
        found: share of visible joints found where they are.
    """

    shift: tuple[float, float, float]
    lost: float
    gained: float
    point_shift: tuple[float, float]
    quality: tuple[float, float]
    uncertainty: tuple[float, float]
    found: float


def effect(requests: Sequence[Observe], before: Sequence[PoseEstimate], after: Sequence[PoseEstimate]) -> Effect:
    """Compare what was seen with what is seen now."""

    def stacked(name: str) -> tuple[Array, Array]:
        return np.stack([getattr(one, name) for one in before]), np.stack([getattr(one, name) for one in after])

    (old, new), (old_points, new_points), (old_quality, new_quality) = map(stacked, ("keypoints", "points", "quality"))
    was, now = np.isfinite(old[..., 0]), np.isfinite(new[..., 0])
    shift = np.linalg.norm(new - old, axis=-1)[was & now]
    moved = np.linalg.norm(new_points - old_points, axis=-1)
    moved = moved[np.isfinite(moved)]
    change = np.abs(new_quality - old_quality)[was | now]
    unsure = np.array([[weighted_uncertainty(q) for q in qualities] for qualities in (old_quality, new_quality)])
    return Effect(
        shift=(float(np.median(shift)), float(np.quantile(shift, 0.95)), float(shift.max())),
        lost=float((was & ~now).sum() / was.sum()),
        gained=float((now & ~was).sum() / was.sum()),
        point_shift=(float(np.median(moved)), float(np.quantile(moved, 0.95))),
        quality=(float(change.mean()), float(np.quantile(change, 0.95))),
        uncertainty=(float(np.abs(unsure[1] - unsure[0]).mean()), float((unsure[1] - unsure[0]).mean())),
        found=detection([finding(*pair) for pair in zip(requests, after, strict=True)]).found_of_visible,
    )


def effect_table(effects: Mapping[str, Effect]) -> str:
    """Pixels, millimetres and shares."""
    head = (
        "| frames | keypoints move: median, 95%, most, px | lost | gained | points move: median, 95%, mm "
        "| quality changes: mean, 95% | weighted uncertainty: mean change, and signed | visible joints found |\n"
        "|---|---|---:|---:|---|---|---|---:|"
    )
    rows = [
        f"| {name} | {', '.join(f'{value:.2f}' for value in one.shift)} | {one.lost:.2%} | {one.gained:.2%} "
        f"| {', '.join(f'{1e3 * value:.2f}' for value in one.point_shift)} "
        f"| {', '.join(f'{value:.4f}' for value in one.quality)} "
        f"| {one.uncertainty[0]:.3f}, {one.uncertainty[1]:+.3f} | {one.found:.2%} |"
        for name, one in effects.items()
    ]
    return "\n".join([head, *rows])


def changes(height: int, width: int) -> dict[str, Callable[[Frame], Frame]]:
    """The frames after each way that is compared by its estimates."""

    def colours(way: Way) -> Callable[[Frame], Frame]:
        return lambda frame: replace(frame, rgb=np.ascontiguousarray(way.unpack(way.pack(frame.rgb))))

    exact = Way(compress_colours, partial(decompress_colours, height=height, width=width))
    return {
        "none": lambda frame: frame,
        "lossless": colours(exact),
        **{name: colours(way) for name, way in jpegs().items()},
        "depth in 16-bit millimetres": lambda frame: replace(frame, depth=to_metres(to_millimetres(frame.depth))),
    }


def effects(pair: WorkerPair, requests: Sequence[Observe], frames: Sequence[Frame]) -> dict[str, Effect]:
    """The effect of each change on the estimates."""
    height, width = frames[0].depth.shape
    seen: dict[str, list[PoseEstimate]] = {}
    for name, change in changes(height, width).items():
        pairs = zip(requests, map(change, frames), strict=True)
        looks = [Perceive(frame=frame, filter=request.filter) for request, frame in pairs]
        seen[name] = list(pair.perceiver.map(looks))
    return {name: effect(requests, seen["none"], estimates) for name, estimates in seen.items()}


def rendered(pair: WorkerPair, requests: Sequence[Observe], noise: Any) -> list[Frame]:
    """The frames that are asked for, with depth as exact or noisy as is told."""
    asked = [
        Render(scene=request.scene, camera=replace(request.camera, depth_noise=noise), truth=True)
        for request in requests
    ]
    return list(pair.renderer.map(asked))


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frames", description=__doc__)
    parser.add_argument("--frames", type=int, default=100)
    options = parser.parse_args()
    # As the perception worker does: what stands here is the time of one core.
    cv2.setNumThreads(1)
    config, console = RunConfig(), Console(soft_wrap=True)
    with (
        stop_on_signals() as stop,
        open_display(Console(stderr=True)) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        requests = list(observe_requests(pair, front_views(seed=0), options.frames, config.environment))
        frames, noisy = rendered(pair, requests, "none"), rendered(pair, requests, "d435i")
        console.print(f"machine: {machine_kind()}; {options.frames} frames", markup=False)
        height, width = frames[0].depth.shape
        for what, ways, arrays in (
            ("colours", colour_ways(height, width), [frame.rgb for frame in frames]),
            ("exact depth", depth_ways(height, width), [frame.depth for frame in frames]),
            ("a D435i's depth", depth_ways(height, width), [frame.depth for frame in noisy]),
        ):
            console.print("\n" + cost_table(what, costs(ways, arrays)), markup=False)
        console.print("\n" + effect_table(effects(pair, requests, frames)), markup=False)


if __name__ == "__main__":
    main()
