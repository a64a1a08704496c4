"""The thesis's histogram of run times: its quality of estimation computed 10 000 times, one after the other.

    python -m benchmarks.estimation.quality_times --plot docs/images/quality-times.png

Views of test scenes are rendered, inferred and lifted first (`benchmarks.estimation.quality`); then the quality of each
is computed in turn, in one process and one thread. The thesis says "within 5 ms". Times are of the thread's own work,
without the machine's other work; those by the clock are printed as well.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure as Picture
from msgspec import Struct
from rich.console import Console
from rich.progress import track

from benchmarks.estimation.quality import ours, recorded, timed
from benchmarks.machine import machine_kind
from orchestrator.experiments.pages.plots import write
from protocol.arrays import Float64Array

CLAIM = 5.0
"""Milliseconds, the claim of the thesis."""


class RunTimes(Struct, frozen=True, kw_only=True):
    """Milliseconds; `within_claim` is the share of computations that took at most `CLAIM`."""

    computations: int
    median: float
    p99: float
    longest: float
    within_claim: float


def run_times(milliseconds: Float64Array) -> RunTimes:
    """Statistics of the times of many computations."""
    return RunTimes(
        computations=len(milliseconds),
        median=float(np.quantile(milliseconds, 0.5)),
        p99=float(np.quantile(milliseconds, 0.99)),
        longest=float(milliseconds.max()),
        within_claim=float(np.mean(milliseconds <= CLAIM)),
    )


def told(found: RunTimes) -> str:
    """In a sentence."""
    return (
        f"{found.computations} computations, median {found.median:.2f} ms, 99% within {found.p99:.2f} ms, longest "
        f"{found.longest:.2f} ms; {found.within_claim:.2%} within {CLAIM:g} ms"
    )


def histogram(milliseconds: Float64Array) -> Picture:
    """The histogram of times; its axes show single long ones."""
    found = run_times(milliseconds)
    picture = Picture(figsize=(7.0, 4.0), layout="constrained")
    place = picture.subplots()
    edges = np.geomspace(milliseconds.min() * 0.98, max(milliseconds.max(), CLAIM) * 1.05, 80)
    place.hist(milliseconds, bins=edges, color="#1f4e79")
    for value, words, style in (
        (found.median, f"median {found.median:.2f} ms", "-"),
        (found.p99, f"99% within {found.p99:.2f} ms", "--"),
        (CLAIM, f"the thesis's claim, {CLAIM:g} ms ({found.within_claim:.2%} within)", ":"),
    ):
        place.axvline(value, color="#c55a11", ls=style, lw=1.4, label=words)
    place.set(xscale="log", yscale="log", xlabel="the thread's own time for one computation, ms", ylabel="computations")
    place.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    place.xaxis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:g}"[-1] in "25" else "")
    place.set_title(
        f"Quality of estimation of one frame, n = {found.computations}, longest {found.longest:.2f} ms", fontsize=10
    )
    place.legend(fontsize=9)
    return picture


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.estimation.quality_times",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--computations", type=int, default=10_000)
    parser.add_argument("--frames", type=int, default=200, help="different views that they are of")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="a picture to write, as PNG")
    options = parser.parse_args(arguments)
    # As the perception worker does.
    cv2.setNumThreads(1)
    errors, console = Console(stderr=True), Console(soft_wrap=True)
    views = list(track(recorded(options.frames, 0), "perceiving", options.frames, console=errors))
    rounds = -(-options.computations // len(views))
    seconds = timed({"qoe": ours()["qoe"]}, views, rounds)["qoe"]
    own, clock = (1e3 * np.array(times[: options.computations]) for times in seconds)
    console.print(f"machine: {machine_kind()}; {len(views)} views, one thread", markup=False)
    for words, milliseconds in (("of the thread's own work", own), ("by the clock", clock)):
        console.print(f"{words}: {told(run_times(milliseconds))}", markup=False)
    if options.plot:
        write(options.plot, histogram(own))


if __name__ == "__main__":
    main()
