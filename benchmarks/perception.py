"""Perception's stages, its two detectors, and its pose networks compared (the thesis's table 2.1 on our renders).

    python -m benchmarks.perception --frames 600

Views of test identities, 1.5 to 9 m away, from all around, and each from where the drone would have been a step before;
every network gets the same ones, and `track` continues from the filter of its own view a step before. Times are of
one thread unless a column says two; all networks take turns on each view, so that other work on the machine
slows them alike. Prints Markdown tables. Networks that were not pulled are left out.
"""

import argparse
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, tee
from typing import NamedTuple

import cv2
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console
from rich.progress import Progress

from benchmarks.estimation.pose_quality import BANDS, Comparison, Correlation, Figures, View, compare, figures
from benchmarks.estimation.viewpoints import all_views, observe_requests, requests_before
from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import open_display
from orchestrator.pictures.worker_pair import WorkerPair, worker_pair
from perception_worker.detection import HeldPictures
from perception_worker.detection.choice import open_detector
from perception_worker.lifter import open_lifter
from perception_worker.networks.backend import open_network
from perception_worker.networks.network import Network
from perception_worker.perceive import Perceiver
from perception_worker.worker import with_lifter_at_hand
from protocol.arrays import UInt8Array
from protocol.config import PerceptionConfig, Profile, RunConfig, settled
from protocol.errors import ArtifactMissing
from protocol.frame import Frame
from protocol.messages import Render
from protocol.region import Region
from protocol.system.stop_request import stop_on_signals

FARTHEST = 9.0
STAGES = ("infer", "decode", "lift", "qoe", "filter")
_WHOLE, _TRACK = PerceptionConfig(look="whole", calibration="none"), PerceptionConfig(look="track", calibration="none")

WHOLE, TRACK = "openpose_mobilenet_thin, whole", "openpose_mobilenet_thin_5, track"

SIZES: dict[str, PerceptionConfig] = {
    f"{TRACK} at {rows}×{columns}": replace(_TRACK, region_height=rows, region_width=columns)
    for rows, columns in (
        *((side, side) for side in (128, 160, 192, 224, 256)),
        *((rows, columns) for rows, columns in ((160, 112), (176, 120), (192, 128), (192, 144), (224, 160))),
    )
}
"""The network's size for the region, from which the default was chosen."""

OTHERS: dict[str, PerceptionConfig] = {
    "openpose_mobilenet_thin, track": replace(_TRACK, network="openpose_mobilenet_thin"),
    "openpose_mobilenet_thin, bf16, whole": replace(_WHOLE, precision="bf16"),
    "openpose_mobilenet_thin_5, bf16, track": replace(_TRACK, precision="bf16"),
    **{
        f"{name}, {one.look}": replace(one, network=name)
        for name in ("movenet_lightning", "movenet_thunder", "blazepose_full")
        for one in (_WHOLE, _TRACK)
    },
}

NETWORKS: dict[str, PerceptionConfig] = {WHOLE: _WHOLE, TRACK: _TRACK, **SIZES, **OTHERS}
"""The rows of the tables."""

ENGINES: dict[str, dict[str, object]] = {
    "OpenVINO, 1 thread": {"backend": "openvino", "threads": 1},
    "OpenVINO, 2 threads": {"backend": "openvino", "threads": 2},
    "ONNX Runtime, 1 thread": {"backend": "onnxruntime", "threads": 1},
    "ONNX Runtime, 2 threads": {"backend": "onnxruntime", "threads": 2},
}

PICTURES_TIMED = 60

Seconds = dict[str, list[float]]


class Moment(NamedTuple):
    """A view, and the same person from where the drone would have been a step before."""

    view: View
    before: Frame
    frame: Frame


class Seen(Struct, frozen=True, eq=False):
    """One network's result for a view.

    Attributes:
        searched: whether it looked at the whole frame.
    """

    comparison: Comparison
    timings: Mapping[str, float]
    searched: bool


class Noted(HeldPictures):
    """A frame of which it is noted whether all of it was looked at."""

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        self.searched = False

    def part(self, region: Region) -> Frame:
        """Exactly that part."""
        self.searched |= region == self.area
        return super().part(region)


def moments(pair: WorkerPair, frames: int, config: RunConfig) -> Iterator[Moment]:
    """Views of test scenes and what the render worker draws of them, with the truth."""
    viewpoints, again = tee(all_views(seed=0, farthest=FARTHEST))
    requests, asked = tee(observe_requests(pair, viewpoints, frames, config.environment))
    befores = requests_before(asked, config.environment, seed=0)
    for request, before, viewpoint in zip(requests, befores, again, strict=False):
        seen = (Render(scene=one.scene, camera=one.camera, truth=True) for one in (before, request))
        yield Moment(View(request, viewpoint.angle, viewpoint.distance), *pair.renderer.map(seen))


def pulled_networks(names: Mapping[str, PerceptionConfig], console: Console) -> dict[str, PerceptionConfig]:
    """The rows whose network is here."""
    found: dict[str, PerceptionConfig] = {}
    for name, config in names.items():
        try:
            open_network(config)
        except ArtifactMissing as error:
            console.print(f"{name} is left out: {error}")
        else:
            found[name] = config
    return found


def seen(perceiver: Perceiver, moment: Moment) -> Seen:
    """A network's estimate of a view, with the filter of its own view a step before."""
    before = perceiver.perceive(moment.before, moment.view.request.filter)
    pictures = Noted(moment.frame)
    estimate = perceiver.observe(pictures, before.filter)
    return Seen(compare(moment.view, estimate), estimate.timings, pictures.searched)


def seen_by_all(
    configs: Mapping[str, PerceptionConfig], profile: Profile, views: Iterator[Moment], pictures: list[UInt8Array]
) -> dict[str, list[Seen]]:
    """The results of every network for every view; the first pictures are kept for `speeds`."""
    perceivers = {name: _perceiver(settled(config, profile)) for name, config in configs.items()}
    found: dict[str, list[Seen]] = {name: [] for name in configs}
    for moment in views:
        if len(pictures) < PICTURES_TIMED:
            pictures.append(moment.frame.rgb)
        for name, perceiver in perceivers.items():
            found[name].append(seen(perceiver, moment))
    return found


def _perceiver(config: PerceptionConfig) -> Perceiver:
    """With the lifter that ships for the network, where one does."""
    chosen = with_lifter_at_hand(config)
    lifter = open_lifter(chosen) if chosen.lifting == "learned" else None
    return Perceiver(open_detector(chosen), chosen, lifter=lifter)


def speeds(networks: Mapping[str, PerceptionConfig], pictures: Sequence[UInt8Array], progress: Progress) -> Seconds:
    """Seconds of each picture by network and engine, in turns: one look, at a whole frame or at a region of 360×260."""
    timed = {
        f"{name}|{engine}": (open_network(replace(_of_look(config), **options)), config.look)
        for name, config in networks.items()
        for engine, options in ENGINES.items()
        if (config.look == "whole" or config.region_height)
        and (config.precision == "f32" or "openvino" in options.values())
    }
    seconds: Seconds = {name: [] for name in timed}
    for picture in progress.track(pictures, description="frames a second"):
        for name, (network, own) in timed.items():
            seconds[name].append(_timed(network, picture if own == "whole" else picture[60:420, 190:450]))
    return seconds


def _of_look(config: PerceptionConfig) -> PerceptionConfig:
    region = {"input_height": config.region_height, "input_width": config.region_width}
    return config if config.look == "whole" else replace(config, **region)


def _timed(network: Network, picture: UInt8Array) -> float:
    begun = time.perf_counter()
    network.decode(network.infer(picture))
    return time.perf_counter() - begun


def stage_table(timings: Sequence[Mapping[str, float]]) -> str:
    """Milliseconds of each stage: the median, the mean and the 99th percentile."""
    rows: list[str] = []
    for stage in STAGES:
        seconds = 1e3 * np.array([each[stage] for each in timings])
        rows.append(f"| {stage} | {np.median(seconds):.2f} | {seconds.mean():.2f} | {np.quantile(seconds, 0.99):.2f} |")
    return "\n".join(["| stage | median, ms | mean, ms | 99th percentile, ms |", "|---|---:|---:|---:|", *rows])


def speed_table(seconds: Seconds) -> str:
    """Looks a second of each network, by engine and threads."""
    names = dict.fromkeys(key.partition("|")[0] for key in seconds)
    rows: list[str] = []
    for name in names:
        found = (seconds.get(f"{name}|{engine}") for engine in ENGINES)
        rows.append(f"| {name} | " + " | ".join(f"{1 / statistics.median(f):.1f}" if f else "–" for f in found) + " |")
    return "\n".join([f"| looks/s | {' | '.join(ENGINES)} |", "|---|" + "---:|" * len(ENGINES), *rows])


def picture_table(by_network: Mapping[str, Sequence[Seen]]) -> str:
    """The joints that each network finds, its errors in space, and its time, a row each."""
    head = f"| network | infer: median, mean, ms | joints found /18 | right in the picture | {' | '.join(BANDS)} | "
    head += "joint error: median, mean, m | nobody | looked at whole |"
    return "\n".join(
        [head, "|---|---:|---:|---:|" + "---:|" * (len(BANDS) + 3), *map(_picture_row, *_unzip(by_network))]
    )


def _picture_row(name: str, seen: Sequence[Seen]) -> str:
    one, infer = _figures(seen), [1e3 * each.timings["infer"] for each in seen]
    bands = " | ".join(f"{share:.1%}" for share in one.right_in)
    return (
        f"| {name} | {np.median(infer):.1f}, {np.mean(infer):.1f} | {one.found:.1f} | {one.right:.1%} | {bands} | "
        f"{one.error:.3f}, {one.mean_error:.3f} | {one.nobody:.2%} | {np.mean([each.searched for each in seen]):.1%} |"
    )


def trust_table(by_network: Mapping[str, Sequence[Seen]]) -> str:
    """The correlation of each network's quality with its errors, and its confusions, a row each."""
    head = "| network | ρ | ρ, clipped at 1 m | left–right swaps | faces on backs |"
    return "\n".join([head, "|---|---:|---:|---:|---:|", *map(_trust_row, *_unzip(by_network))])


def _trust_row(name: str, seen: Sequence[Seen]) -> str:
    one = _figures(seen)
    correlations = f"{_interval(one.correlation)} | {_interval(one.clipped_correlation)}"
    return f"| {name} | {correlations} | {one.swapped:.1%} | {one.faces_behind:.0%} |"


def _figures(seen: Sequence[Seen]) -> Figures:
    return figures([each.comparison for each in seen])


def _unzip(by_network: Mapping[str, Sequence[Seen]]) -> tuple[list[str], list[Sequence[Seen]]]:
    return list(by_network), list(by_network.values())


def _interval(found: Correlation) -> str:
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


def measure(frames: int, profile: Profile, names: Mapping[str, PerceptionConfig], console: Console) -> Iterator[str]:
    """All tables as Markdown."""
    # As the worker does: OpenCV's own threads would only contend for the same cores.
    cv2.setNumThreads(1)
    config, networks, pictures = RunConfig(), pulled_networks(names, console), list[UInt8Array]()
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
        Progress(console=console) as progress,
    ):
        views = progress.track(moments(pair, frames, config), frames, description="perceiving")
        found = seen_by_all(networks, profile, iter(views), pictures)
        for name in islice(networks, 2):
            yield f"{name}, one thread:\n\n{stage_table([each.timings for each in found[name]])}"
        yield picture_table(found)
        yield trust_table(found)
        yield speed_table(speeds(networks, pictures, progress))


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.perception",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--frames", type=int, default=600, help="views (default: %(default)s)")
    parser.add_argument("--profile", choices=["thesis", "vantage"], default="vantage", help="whose way of lifting")
    parser.add_argument("--sizes", action="store_true", help="the default network in its sizes alone")
    options = parser.parse_args(arguments)
    errors, console = Console(stderr=True), Console(soft_wrap=True)
    names = {WHOLE: _WHOLE, TRACK: _TRACK, **SIZES} if options.sizes else NETWORKS
    console.print(f"machine: {machine_kind()}; {options.frames} views; profile {options.profile}", highlight=False)
    for table in measure(options.frames, options.profile, names, errors):
        console.print(f"\n{table}", markup=False, highlight=False)


if __name__ == "__main__":
    main()
