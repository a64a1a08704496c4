"""Perception's stages, and the pose networks against each other (the seed's table 2.1 on our renders).

    python -m benchmarks.perception --frames 300

Views of test identities, 1.5 to 6 m away, from all around, rendered once; every network looks at the same ones. Times
are of one thread unless a column says two; frames a second are from a picture to keypoints, all networks taking turns,
so that other work on the machine slows them alike. Prints Markdown tables. Networks that were not pulled are left out.
"""

import argparse
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from itertools import tee

import cv2
import numpy as np
from msgspec.structs import asdict, replace
from rich.console import Console
from rich.progress import Progress, TaskID

from benchmarks.machine import machine_kind
from benchmarks.pose_quality import Correlation, Estimate, Figures, View, estimate, figures
from benchmarks.viewpoints import all_views, observe_requests
from orchestrator.live_display import open_display
from orchestrator.stop_request import stop_on_signals
from orchestrator.worker_pair import worker_pair
from perception_worker.backend import open_network
from perception_worker.network import Network
from perception_worker.perceive import Perceiver
from protocol.arrays import UInt8Array
from protocol.config import PerceptionConfig, Profile, RunConfig
from protocol.errors import ArtifactMissing
from protocol.frame import Frame
from protocol.messages import Render
from protocol.observation import FilterState

STAGES = ("infer", "decode", "lift", "qoe", "filter")

DEFAULT = "openpose_mobilenet_thin, f32"

NETWORKS: dict[str, PerceptionConfig] = {
    DEFAULT: PerceptionConfig(),
    "openpose_mobilenet_thin, bf16": PerceptionConfig(precision="bf16"),
    "openpose_mobilenet_thin, crop": PerceptionConfig(crop="person"),
    "movenet_lightning": PerceptionConfig(network="movenet_lightning"),
    "movenet_lightning, crop": PerceptionConfig(network="movenet_lightning", crop="person"),
    "movenet_thunder": PerceptionConfig(network="movenet_thunder"),
    "movenet_thunder, crop": PerceptionConfig(network="movenet_thunder", crop="person"),
    "blazepose_full": PerceptionConfig(network="blazepose_full"),
    "blazepose_full, crop": PerceptionConfig(network="blazepose_full", crop="person"),
}
"""What each row of the table is; `crop` is a second look at the person."""

ENGINES: dict[str, dict[str, object]] = {
    "OpenVINO, 1 thread": {"backend": "openvino", "threads": 1},
    "OpenVINO, 2 threads": {"backend": "openvino", "threads": 2},
    "ONNX Runtime, 1 thread": {"backend": "onnxruntime", "threads": 1},
    "ONNX Runtime, 2 threads": {"backend": "onnxruntime", "threads": 2},
}

Views = Sequence[tuple[View, Frame]]
Seconds = dict[str, list[float]]


def rendered_views(frames: int, config: RunConfig, console: Console) -> list[tuple[View, Frame]]:
    """Views of test scenes and what the render worker draws of them, with the truth."""
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        viewpoints, again = tee(all_views(seed=0))
        requests = observe_requests(pair, viewpoints, frames, config.environment)
        views = [View(request, viewpoint.angle) for request, viewpoint in zip(requests, again, strict=False)]
        with Progress(console=console) as progress:
            pictures = (
                pair.renderer.call(Render(scene=view.request.scene, camera=view.request.camera, truth=True))
                for view in views
            )
            return list(zip(views, progress.track(pictures, len(views), description="rendering"), strict=True))


def pulled_networks(console: Console) -> dict[str, PerceptionConfig]:
    """The rows whose network is here."""
    found: dict[str, PerceptionConfig] = {}
    for name, config in NETWORKS.items():
        try:
            open_network(config)
        except ArtifactMissing as error:
            console.print(f"{name} is left out: {error}")
        else:
            found[name] = config
    return found


def look(config: PerceptionConfig, profile: Profile, views: Views) -> Iterator[tuple[Estimate, Mapping[str, float]]]:
    """What a network makes of every view, and its seconds by stage."""
    perceiver = Perceiver(open_network(config), config, profile=profile)
    perceiver.perceive(views[0][1], views[0][0].request.filter)
    for view, frame in views:
        observation = perceiver.perceive(frame, view.request.filter or FilterState.initial())
        yield estimate(view, observation), observation.timings


def speeds(networks: Mapping[str, PerceptionConfig], pictures: Sequence[UInt8Array], progress: Progress) -> Seconds:
    """Seconds of each picture by network and engine, in turns; a second look is not in them."""
    single = {name: config for name, config in networks.items() if config.crop == "none"}
    timed = {
        f"{name}|{engine}": open_network(replace(config, **options))
        for name, config in single.items()
        for engine, options in ENGINES.items()
        if config.precision == "f32" or options["backend"] == "openvino"
    }
    seconds: Seconds = {name: [] for name in timed}
    for picture in progress.track(pictures, description="frames a second"):
        for name, network in timed.items():
            seconds[name].append(_timed(network, picture))
    return seconds


def _timed(network: Network, picture: UInt8Array) -> float:
    begun = time.perf_counter()
    network.decode(network.infer(picture))
    return time.perf_counter() - begun


def stage_table(timings: Sequence[Mapping[str, float]]) -> str:
    """Milliseconds of each stage: the median and the 99th percentile."""
    rows = []
    for stage in STAGES:
        milliseconds = 1e3 * np.array([each[stage] for each in timings])
        rows.append(f"| {stage} | {np.median(milliseconds):.2f} | {np.quantile(milliseconds, 0.99):.2f} |")
    return "\n".join(["| stage | median, ms | 99th percentile, ms |", "|---|---:|---:|", *rows])


def speed_table(seconds: Seconds) -> str:
    """Frames a second of each network, by engine and threads."""
    names = dict.fromkeys(key.partition("|")[0] for key in seconds)
    rows = []
    for name in names:
        found = (seconds.get(f"{name}|{engine}") for engine in ENGINES)
        rows.append(f"| {name} | " + " | ".join(f"{1 / statistics.median(f):.1f}" if f else "–" for f in found) + " |")
    return "\n".join([f"| frames/s | {' | '.join(ENGINES)} |", "|---|" + "---:|" * len(ENGINES), *rows])


def quality_table(by_network: Mapping[str, Figures]) -> str:
    """What each network is worth, a row each."""
    head = "| network | joints found /18 | right in the picture | joint error, m | ρ | ρ, clipped at 1 m | "
    head += "left–right swaps | faces on backs | nobody |"
    rows = [
        f"| {name} | {one.found:.1f} | {one.right:.1%} | {one.error:.3f} | {_interval(one.correlation)} | "
        f"{_interval(one.clipped_correlation)} | {one.swapped:.1%} | {one.faces_behind:.0%} | {one.nobody:.1%} |"
        for name, one in by_network.items()
    ]
    return "\n".join([head, "|---|" + "---:|" * len(asdict(next(iter(by_network.values())))), *rows])


def _interval(found: Correlation) -> str:
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


def measure(views: Views, profile: Profile, console: Console) -> str:
    """All tables as Markdown."""
    # As the worker does: OpenCV's own threads would only contend for the same cores.
    cv2.setNumThreads(1)
    networks = pulled_networks(console)
    looks: dict[str, list[tuple[Estimate, Mapping[str, float]]]] = {}
    with Progress(console=console) as progress:
        for name, config in networks.items():
            task: TaskID = progress.add_task(name, total=len(views))
            looks[name] = []
            for seen in look(config, profile, views):
                looks[name].append(seen)
                progress.advance(task)
        seconds = speeds(networks, [frame.rgb for _, frame in views[:60]], progress)
    quality = {name: figures([seen for seen, _ in found]) for name, found in looks.items()}
    stages = stage_table([timings for _, timings in looks[DEFAULT]])
    return "\n\n".join([f"{DEFAULT}, one thread:\n\n{stages}", speed_table(seconds), quality_table(quality)])


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.perception",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--frames", type=int, default=300, help="views, 2 MB of memory each (default: %(default)s)")
    parser.add_argument("--profile", choices=["thesis", "vantage"], default="vantage", help="whose way of lifting")
    options = parser.parse_args(arguments)
    errors, console = Console(stderr=True), Console(soft_wrap=True)
    views = rendered_views(options.frames, RunConfig(), errors)
    console.print(f"machine: {machine_kind()}; {len(views)} views; profile {options.profile}\n", highlight=False)
    console.print(measure(views, options.profile, errors), markup=False, highlight=False)


if __name__ == "__main__":
    main()
