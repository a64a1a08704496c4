"""What each thing that a lifter is told is worth, and what wide poses are: fits without it, on the same views.

    python -m benchmarks.lifter_ablation runs/lifter/views.parquet

Prints the mean error of joints on people whom no fit has seen, by whether the joint was found and by their poses. Fits
are smaller than the one that ships: compare them with each other.
"""

import argparse
import logging
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.machine import machine_kind
from perception_worker.lifter.fitting.certainty import tried
from perception_worker.lifter.fitting.fit import HELD_OUT
from perception_worker.lifter.fitting.frames import Frames, read_frames
from perception_worker.lifter.fitting.training import Training, train
from perception_worker.lifter.network import LifterNetwork, Shape
from perception_worker.lifter.tokens import INPUTS

_logger = logging.getLogger(__name__)


def fits(training: Training) -> Iterator[tuple[str, Training, bool]]:
    """What is left out, how a fit learns without it, and whether it sees wide poses."""
    yield "nothing", training, True
    for name in INPUTS:
        yield name, Training(epochs=training.epochs, seed=training.seed, without=(name,)), True
    yield "both windows", Training(epochs=training.epochs, without=("narrow window", "wide window")), True
    yield "wide poses", training, False


def row(name: str, training: Training, seen: Frames, others: Frames) -> str:
    """A line of the table."""
    shape = Shape()
    weights = train(seen, shape, training, told=lambda epoch, loss: _logger.info("%s %d %.4f", name, epoch, loss))
    trial = tried(LifterNetwork(shape, weights), others, training.without)
    groups = [(poses, found) for poses in (others.wide, ~others.wide) for found in (trial.found, ~trial.found)]
    errors = [trial.error[poses[:, None] & found].mean() for poses, found in groups]
    return f"| {name} | " + " | ".join(f"{error:.3f}" for error in errors) + " |"


def main() -> None:
    """Fit and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lifter_ablation", description=__doc__)
    parser.add_argument("table", type=Path, help="of 'orchestrator lifter fit'")
    parser.add_argument("--frames", type=int, default=12000, help="that each fit learns from (default: 12000)")
    parser.add_argument("--epochs", type=int, default=30)
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    frames = read_frames(options.table)
    held_out = np.isin(frames.identity, np.unique(frames.identity)[HELD_OUT - 1 :: HELD_OUT])
    seen, others = frames.of(~held_out), frames.of(held_out)
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}\n{options.frames} frames, {options.epochs} epochs; metres\n")
    console.print(
        "| without | wide poses: seen | inferred | the eight kinds: seen | inferred |\n|---|---:|---:|---:|---:|"
    )
    for name, training, wide in fits(Training(epochs=options.epochs)):
        chosen = seen if wide else seen.of(~seen.wide)
        console.print(row(name, training, chosen.of(np.arange(min(options.frames, len(chosen)))), others))


if __name__ == "__main__":
    main()
