"""The best factor from a lifter's variance to an observation's noise, and the best growth of process noise.

    python -m benchmarks.estimation.filter_noise runs/experiments/train/flights.parquet

Replays the flights of `orchestrator experiment flights`, on train identities, with each pair of constants, and prints
figures of the posterior. `perception_worker.kalman` has the chosen constants.
"""

import argparse
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray
from rich.console import Console

from orchestrator.experiments.figures.flight_figures import flown_samples
from orchestrator.experiments.figures.posterior_figures import SETTLED, radius_of
from orchestrator.experiments.figures.sample import Sample, truth_of
from protocol.arrays import BoolArray, Float64Array

REPEATED = (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
FORGOTTEN = (0.0, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)


_UNKNOWN = 1.0
"""m² before anything is seen, as a filter begins."""


class Replay(NamedTuple):
    """(frames, 18, 3) each: a filter's error and variance after each picture; metres, m²."""

    error: Float64Array
    variance: Float64Array


def replayed(sample: Sample, repeated: float, forgotten: float) -> Replay:
    """The flights of a sample with a filter of its own constants."""
    points, noise, truth = _axes(sample, ""), repeated * _axes(sample, "variance_"), truth_of(sample)
    error, variance = np.full_like(points, np.nan), np.full_like(points, np.nan)
    for frames in _flights(sample):
        mean, spread = np.zeros_like(points[0]), np.full_like(points[0], _UNKNOWN)
        for frame in frames:
            located = np.isfinite(points[frame]) & np.isfinite(noise[frame])
            predicted = spread + forgotten
            # By precisions: nothing is known at first, and what is not located has none.
            precision = np.where(located, 1.0 / noise[frame], 0.0)
            spread = 1.0 / (1.0 / predicted + precision)
            mean = np.where(located, mean + np.where(located, spread * precision, 0.0) * (points[frame] - mean), mean)
            error[frame], variance[frame] = mean - truth[frame], spread
    return Replay(error, variance)


def _flights(sample: Sample) -> Iterator[NDArray[np.intp]]:
    for flight in np.unique(sample["flight"]):
        frames = np.flatnonzero(sample["flight"] == flight)
        yield frames[np.argsort(sample["step"][frames])]


def _axes(sample: Sample, prefix: str) -> Float64Array:
    return np.stack([sample[f"{prefix}{axis}"] for axis in "xyz"], axis=2)


def row(sample: Sample, repeated: float, forgotten: float) -> str:
    """A line of the table."""
    error, variance = replayed(sample, repeated, forgotten)
    known: BoolArray = np.all(np.isfinite(variance), axis=2)
    late = known & (sample["step"] >= SETTLED)[:, None]
    away, radius = np.linalg.norm(error, axis=2), radius_of(np.where(known[..., None], variance, 1.0))
    within, held = np.mean(error**2 <= variance, axis=2), away <= radius
    figures = [away[late], within[known], within[late], held[known], held[late], radius[late]]
    return f"| {repeated:g} | {forgotten:g} | " + " | ".join(f"{values.mean():.3f}" for values in figures) + " |"


def main() -> None:
    """Replay and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.estimation.filter_noise", description=__doc__)
    parser.add_argument("table", type=Path, help="of 'orchestrator experiment flights'")
    options = parser.parse_args()
    console = Console(soft_wrap=True)
    for (noise, path), sample in flown_samples(pq.read_table(options.table)).items():
        console.print(f"\ndepth {noise}, {path}: *late* from picture {SETTLED} on\n")
        console.print(
            "| times the variance | m² forgotten | error late, m | within, all | late | held, all | late | radius, m |"
        )
        console.print("|---:|---:|---:|---:|---:|---:|---:|---:|")
        for repeated, forgotten in itertools.product(REPEATED, FORGOTTEN):
            console.print(row(sample, repeated, forgotten))


if __name__ == "__main__":
    main()
