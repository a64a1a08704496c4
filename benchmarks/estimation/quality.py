"""The cost of decoding, quality of estimation and its calibration in metres, for a frame on one core.

    python -m benchmarks.estimation.quality --frames 200 --bystanders 1
    python -m benchmarks.estimation.quality --against ../another-checkout

Views of test scenes, 1.5 to 6 m away, from all around, are rendered and inferred first; then every stage takes its turn
on every view. Times are of the thread's own work, which other work on the machine lengthens less than the clock's;
the clock's are printed as well. With `--against`, `decoding.py` and `qoe.py` of another checkout take turns with ours,
and their results are compared.
"""

import argparse
import importlib.util
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.estimation.viewpoints import all_views
from benchmarks.machine import machine_kind
from orchestrator.pictures.view import camera_at
from perception_worker import qoe
from perception_worker.calibration.choice import open_calibration
from perception_worker.lifting import lift, windows_around
from perception_worker.networks import decoding
from perception_worker.networks.backend import open_network
from perception_worker.networks.network import NetworkOutput
from protocol.arrays import Float64Array
from protocol.camera import Camera
from protocol.config import RunConfig, settled
from protocol.errors import Unavailable
from protocol.frame import Frame
from protocol.region import Region
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

THRESHOLD = 0.1
"""The default network's, which a peak must exceed."""

COMPONENTS = ("mass", "height", "distance", "combined")


class Recorded(NamedTuple):
    """One view after inference.

    Attributes:
        size: height and width of the picture.
        keypoints: (18, 2) pixels; `points`: (18, 3) metres; `others`: (n, 18, 2) cells, as the quality takes them.
        spread: (18,) metres of depth around each keypoint.
        quality: of the joints, as the calibration takes it.
    """

    output: NetworkOutput
    size: tuple[int, int]
    keypoints: Float64Array
    points: Float64Array
    others: Any
    camera: Camera
    spread: Float64Array
    quality: qoe.Quality


Stage = Callable[[Recorded], Any]


class Seconds(NamedTuple):
    """Of every call: the thread's own, and the clock's."""

    own: list[float]
    clock: list[float]


def recorded(frames: int, bystanders: int) -> Iterator[Recorded]:
    """Views of test scenes, rendered, inferred and lifted."""
    config = RunConfig()
    network = open_network(config.perception)
    with closing(open_renderer(config.render)) as renderer:
        for seed, viewpoint in zip(range(frames), all_views(seed=0), strict=False):
            scene = sample_scene(seed, "test", bystanders)
            camera = camera_at(viewpoint, scene, config.environment)
            frame = renderer.render(scene, camera)
            yield _recorded(network.infer(frame.rgb), frame, camera)


def _recorded(output: NetworkOutput, frame: Frame, camera: Camera) -> Recorded:
    size, map_size = frame.depth.shape, output.heatmaps.shape[1:]
    people = decoding.decode(output, THRESHOLD)
    keypoints = Region.whole(*size).pixels(people.person, map_size)
    windows = windows_around(frame.depth, keypoints)
    points = lift(windows, keypoints, camera)
    quality = qoe.quality_of_estimation(output.heatmaps, qoe.heatmap_cells(keypoints, size, map_size), points)
    others = qoe.nearest_cells(people.others, map_size)
    return Recorded(output, size, keypoints, points, others, camera, windows.spread, quality)


def stages(decoder: Any = decoding, quality: Any = qoe) -> dict[str, Stage]:
    """The timed stages, by our modules or another checkout's."""

    def cells(view: Recorded) -> Any:
        map_size = view.output.heatmaps.shape[1:]
        if hasattr(quality, "heatmap_cells"):
            return quality.heatmap_cells(view.keypoints, view.size, map_size)
        found = np.isfinite(view.keypoints[:, 0])
        return np.array(
            [
                quality.heatmap_cell(pixel, view.size, map_size) if known else (-1, -1)
                for pixel, known in zip(view.keypoints, found, strict=True)
            ]
        )

    return {
        "decode": lambda view: decoder.decode(view.output, THRESHOLD),
        "qoe": lambda view: quality.quality_of_estimation(view.output.heatmaps, cells(view), view.points),
    }


def ours() -> dict[str, Stage]:
    """Our stages, the quality with other people masked, and the calibration.

    Raises:
        Unavailable: none is shipped for the default worker.
    """
    own = stages()
    config = RunConfig()
    calibration = open_calibration(settled(config.perception, config.profile))
    if calibration is None:
        raise Unavailable("no calibration is shipped for the default worker")

    def masked(view: Recorded) -> Any:
        cells = qoe.heatmap_cells(view.keypoints, view.size, view.output.heatmaps.shape[1:])
        return qoe.quality_of_estimation(view.output.heatmaps, cells, view.points, others=view.others)

    def calibrated(view: Recorded) -> Any:
        return calibration.calibrate(
            view.points,
            mass=view.quality.mass,
            height=view.quality.height,
            distance=view.quality.distance,
            spread=view.spread,
            camera=view.camera.pose.position,
        )

    return own | {"qoe, others masked": masked, "calibrate": calibrated}


def timed(staged: Mapping[str, Stage], views: list[Recorded], rounds: int) -> dict[str, Seconds]:
    """Seconds of each stage on each view; all take turns on a view."""
    seconds = {name: Seconds([], []) for name in staged}
    for view in [*views[:20], *views * rounds]:
        for name, stage in staged.items():
            begun, own = time.perf_counter(), time.thread_time()
            stage(view)
            seconds[name].own.append(time.thread_time() - own)
            seconds[name].clock.append(time.perf_counter() - begun)
    # What the first views cost is the caches' filling.
    return {name: Seconds(found.own[20:], found.clock[20:]) for name, found in seconds.items()}


def table(seconds: Mapping[str, Seconds]) -> str:
    """Milliseconds of each stage."""
    head = "| stage | median, ms | 99th percentile, ms | by the clock: median, ms | 99th percentile, ms |"
    rows = [
        f"| {name} | "
        + " | ".join(f"{1e3 * np.quantile(values, share):.2f}" for values in found for share in (0.5, 0.99))
        + " |"
        for name, found in seconds.items()
    ]
    return "\n".join([head, "|---|" + "---:|" * 4, *rows])


def other_checkout(directory: Path) -> tuple[Any, Any]:
    """`decoding` and `qoe` of another checkout, as modules beside ours."""
    return _loaded(directory, "decoding"), _loaded(directory, "qoe")


def _loaded(directory: Path, name: str) -> Any:
    file = directory / "perception_worker" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"other_{name}", file)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def largest_difference(before: Mapping[str, Stage], views: Sequence[Recorded]) -> str:
    """The largest differences of our results from the other checkout's, over all views."""
    own, cells, quality = stages(), 0.0, 0.0
    for view in views:
        new, old = own["decode"](view).person, before["decode"](view)
        old = getattr(old, "person", old)
        if not np.array_equal(np.isnan(new), np.isnan(old)):
            return "other joints are detected"
        cells = max(cells, float(np.nanmax(np.abs(new - old), initial=0.0)))
        found, expected = own["qoe"](view), before["qoe"](view)
        quality = max(quality, *(float(np.abs(getattr(found, n) - getattr(expected, n)).max()) for n in COMPONENTS))
    return f"largest difference of a keypoint {cells:.1e} cells, of a quality {quality:.1e}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.estimation.quality",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--bystanders", type=int, default=0)
    parser.add_argument("--rounds", type=int, default=10, help="how often every view is gone through")
    parser.add_argument("--against", type=Path, metavar="DIRECTORY", help="another checkout, to take turns with")
    options = parser.parse_args(arguments)
    # As the perception worker does.
    cv2.setNumThreads(1)
    errors, console = Console(stderr=True), Console(soft_wrap=True)
    views = list(track(recorded(options.frames, options.bystanders), "perceiving", options.frames, console=errors))
    staged = ours()
    console.print(f"machine: {machine_kind()}; {len(views)} views, {options.bystanders} bystanders\n", markup=False)
    if options.against:
        before = stages(*other_checkout(options.against))
        staged |= {f"{name}, {options.against.name}": stage for name, stage in before.items()}
        console.print(largest_difference(before, views) + "\n", markup=False)
    console.print(table(timed(staged, views, options.rounds)), markup=False)


if __name__ == "__main__":
    main()
