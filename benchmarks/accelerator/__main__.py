"""The gain of a GPU in each stage, and its effect on results.

    python -m benchmarks.accelerator
    python -m benchmarks.accelerator --only learn,loop

Rendering by the GPU's EGL, the pose network on ONNX Runtime's CUDA or TensorRT (on PyTorch's CUDA where those are
missing), the learner on CUDA, beside the same on this machine's CPU: milliseconds a stage; whether another process gets
the same bytes; how far frames, heatmaps, keypoints, points and observations are from the CPU's; and a short training
with the renderer and the network at each place. Prints Markdown tables. What is missing on this machine is said in its
row. What matters most comes first, should the time run out.
"""

import argparse
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from benchmarks.accelerator.jobs import Jobs
from benchmarks.accelerator.places import places
from benchmarks.accelerator.tables import difference_table, loop_table, missing_gpu, stage_table
from benchmarks.accelerator.trial import KINDS, Trial
from benchmarks.machine import machine_kind


def _kinds(text: str) -> tuple[str, ...]:
    found = tuple(text.split(","))
    if unknown := [kind for kind in found if kind not in KINDS]:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown)}: there are {', '.join(KINDS)}")
    return found


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.accelerator",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--only", type=_kinds, default=KINDS, metavar="KINDS", help=f"of {','.join(KINDS)}; what they need comes along"
    )
    parser.add_argument("--frames", type=int, default=40, help="views that are drawn and perceived")
    parser.add_argument("--updates", type=int, default=300, help="gradient updates")
    parser.add_argument("--steps", type=int, default=300, help="of each short training")
    parser.add_argument("--seconds", type=float, default=300.0, help="for all of it; what is left over is not measured")
    parser.add_argument(
        "--anything", action="store_true", help="measure what turns out to be no GPU all the same, to try this out"
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print: the trainings' throughput as soon as it is known, all other tables at the end."""
    options = _options(arguments)
    errors, console = Console(stderr=True, soft_wrap=True), Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}; {options.frames} frames, {options.updates} updates\n", markup=False)
    with tempfile.TemporaryDirectory() as directory:
        jobs = Jobs(Path(directory), errors, seconds=options.seconds, anything=options.anything)
        trial = Trial(jobs, *places(os.environ), frames=options.frames, updates=options.updates, only=options.only)
        trial.measure()
        if loops := trial.loops(options.steps):
            console.print(f"{loop_table(loops)}\n", markup=False)
        trial.repeat()
        trial.perceive_gpu_frames()
        rows = trial.rows()
        if said := missing_gpu(rows):
            console.print(f"{said}\n", markup=False)
        console.print(f"{stage_table(rows)}\n", markup=False)
        console.print(difference_table(dict(trial.differences())), markup=False)


if __name__ == "__main__":
    main()
