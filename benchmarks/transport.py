"""The time to carry a message to a worker and its answer back.

    python -m benchmarks.transport

Transport is a call's time without the worker's queueing and computing: coding, sockets and thread switches. One call
is under way at a time, over ipc to a process.
"""

import argparse
import statistics
from collections.abc import Callable
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import open_display
from orchestrator.pictures.view import Viewpoint, camera_at
from orchestrator.pictures.worker_pair import WorkerPair, worker_pair
from protocol.client.client import Client
from protocol.config import RunConfig
from protocol.message import Request
from protocol.messages import Observe, Render, SampleScene
from protocol.pose_estimate import FilterState
from protocol.system.stop_request import stop_on_signals


def transport_seconds(client: Client, request: Callable[[int], Request[Any]], calls: int) -> list[float]:
    """Of each of `calls` calls, one after the other."""
    seconds: list[float] = []
    for number in range(calls):
        pending = client.submit(request(number))
        pending.result()
        seconds.append(pending.timing.transport)
    return seconds


def measure(pair: WorkerPair, config: RunConfig, calls: int) -> dict[str, list[float]]:
    """A small message, a whole frame, and an estimate, which leaves out the frame's own way."""
    scene = pair.renderer.call(SampleScene(seed=0, split="train")).scene
    camera = camera_at(Viewpoint(), scene, config.environment)
    observe = Observe(scene=scene, camera=camera, filter=FilterState.initial())
    return {
        "SampleScene": transport_seconds(pair.renderer, lambda number: SampleScene(seed=number, split="train"), calls),
        "Render, 640×480 (2.1 MB)": transport_seconds(
            pair.renderer, lambda _: Render(scene=scene, camera=camera), calls
        ),
        "Observe": transport_seconds(pair.perceiver, lambda _: observe, calls),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.transport", description=__doc__)
    parser.add_argument("--calls", type=int, default=200)
    options = parser.parse_args()
    config, console = RunConfig(), Console(soft_wrap=True)
    with (
        stop_on_signals() as stop,
        open_display(Console(stderr=True)) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        seconds = measure(pair, config, options.calls)
    console.print(f"machine: {machine_kind()}")
    console.print("| call | median, ms | 95th percentile, ms |\n|---|---:|---:|")
    for name, values in seconds.items():
        console.print(f"| {name} | {1e3 * statistics.median(values):.2f} | {1e3 * np.quantile(values, 0.95):.2f} |")


if __name__ == "__main__":
    main()
