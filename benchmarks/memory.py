"""The memory of workers over time: one of each, without faults, with a new scene for each request.

    python -m benchmarks.memory --scenes 1000

Prints a Markdown table of the memory that each reports in its pongs.
"""

import argparse
from collections.abc import Iterator

from rich.console import Console

from benchmarks.estimation.viewpoints import front_views, observe_requests
from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import open_display
from orchestrator.pictures.worker_pair import WorkerPair, worker_pair
from protocol.config import RunConfig
from protocol.system.stop_request import stop_on_signals

MIB = 2**20
FIRST_LOOKS = (1, 10, 20, 40)


def looks(scenes: int) -> Iterator[int]:
    """After how many scenes memory is looked at: early on often, and then ten times."""
    yield from (count for count in FIRST_LOOKS if count < scenes / 10)
    yield from (scenes * tenth // 10 for tenth in range(1, 11))


def resident_mib(pair: WorkerPair) -> tuple[float, float]:
    """Of the render and the perception worker."""
    return pair.renderer.ping().resident_bytes / MIB, pair.perceiver.ping().resident_bytes / MIB


def main() -> None:
    """The entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=1000, help="how many (default: %(default)s)")
    scenes = parser.parse_args().scenes
    config, console = RunConfig(), Console(stderr=True)
    rows: list[str] = []
    due = set(looks(scenes))
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        requests = observe_requests(pair, front_views(seed=0), scenes, config.environment, split="train")
        for count, request in enumerate(requests, start=1):
            stop.check()
            pair.perceiver.call(request)
            if count in due:
                render, perception = resident_mib(pair)
                rows.append(f"| {count} | {render:.0f} | {perception:.1f} |")
                console.print(rows[-1])
    Console(soft_wrap=True).print(
        f"machine: {machine_kind()}\n\n| scenes | render worker, MiB | perception worker, MiB |\n|---:|---:|---:|",
        *rows,
        sep="\n",
    )


if __name__ == "__main__":
    main()
