"""Ablations of a lifter: fits without each of its inputs, and without wide poses, on the same views.

    python -m benchmarks.estimation.lifter_ablation runs/lifter/views.parquet
    python -m benchmarks.estimation.lifter_ablation runs/lifter/views.parquet --without height up     # on another core

Prints the mean error of joints on people whom no fit has seen, by whether the joint was found and by their poses; no
joint's error counts as more than 0.5 m, so that the few frames in which all is lost do not decide. *Like a flight's*:
one person alone, in full view, 1.5 to 9 m away, in one of the eight kinds. Fits are smaller than the one that ships:
compare them with each other.
"""

import argparse
import logging
import sys
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from rich.console import Console

from benchmarks.machine import machine_kind
from perception_worker.lifter.fitting.certainty import tried
from perception_worker.lifter.fitting.fit import HELD_OUT
from perception_worker.lifter.fitting.frames import Frames, read_frames
from perception_worker.lifter.fitting.training import Training, train
from perception_worker.lifter.network import LifterNetwork, Shape
from perception_worker.lifter.tokens import INPUTS

_logger = logging.getLogger(__name__)

_MOST_ERROR = 0.5
_HEADER = "| without | like a flight's: seen | inferred | wide poses: seen | inferred |\n|---|---:|---:|---:|---:|"


def fits(training: Training) -> dict[str, tuple[Training, bool]]:
    """By what is left out, how a fit learns without it, and whether it sees wide poses."""
    blind = {name: (name,) for name in INPUTS} | {"both windows": ("narrow window", "wide window")}
    without = {name: (replace(training, without=names), True) for name, names in blind.items()}
    return {"nothing": (training, True)} | without | {"wide poses": (training, False)}


def row(name: str, training: Training, seen: Frames, others: Frames) -> str:
    """A line of the table."""
    shape = Shape()
    weights = train(seen, shape, training, told=lambda epoch, loss: _logger.info("%s %d %.4f", name, epoch, loss))
    trial = tried(LifterNetwork(shape, weights), others, training.without)
    error = np.minimum(trial.error, _MOST_ERROR)
    groups = [(chosen, found) for chosen in (others.usual, others.wide) for found in (trial.found, ~trial.found)]
    errors = [error[chosen[:, None] & found].mean() for chosen, found in groups]
    return f"| {name} | " + " | ".join(f"{one:.4f}" for one in errors) + " |"


def main() -> None:
    """Fit and print."""
    options = _options()
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    frames = read_frames(options.table)
    held_out = np.isin(frames.identity, np.unique(frames.identity)[HELD_OUT - 1 :: HELD_OUT])
    seen, others = frames.of(~held_out), frames.of(held_out)
    console = Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}\n{options.frames} frames, {options.epochs} epochs; metres\n")
    console.print(_HEADER)
    all_fits = fits(Training(epochs=options.epochs))
    for name in options.without or all_fits:
        training, wide = all_fits[name]
        chosen = seen if wide else seen.of(~seen.wide)
        console.print(row(name, training, chosen.of(np.arange(min(options.frames, len(chosen)))), others))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.estimation.lifter_ablation", description=__doc__)
    parser.add_argument("table", type=Path, help="of 'orchestrator lifter fit'")
    parser.add_argument("--frames", type=int, default=24000, help="that each fit learns from (default: 24000)")
    parser.add_argument("--epochs", type=int, default=20)
    names = tuple(fits(Training()))
    parser.add_argument("--without", nargs="+", choices=names, help="the rows to make, of all these (default: all)")
    return parser.parse_args()


if __name__ == "__main__":
    main()
