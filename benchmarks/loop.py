"""The time of a step: each stage alone, all of them in the running loop, and the bound on the loop's throughput.

    python -m benchmarks.loop
    python -m benchmarks.loop --against ../another-checkout --rounds 3

Alone: one request under way in the whole system, and one gradient update at a time. In the loop: a real training by
`orchestrator train`, where the stages of several flights overlap and share the cores. The bound is the throughput of
cores that do nothing but the stages, with each stage as fast as alone. Prints Markdown tables.

With `--against`, another checkout's loop takes turns with ours: each with its own rooms and its own configuration, by
this interpreter. The stages alone are measured of both, by our code.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import msgspec
from msgspec import Struct
from rich.console import Console

from benchmarks import stages_alone
from benchmarks.machine import machine_kind
from benchmarks.stages_alone import StagesAlone, add_options
from orchestrator.monitoring.report import TrainingReport
from protocol.records import Stage
from protocol.system.cores import available_cores

STAGES: tuple[Stage, ...] = get_args(Stage)

OWN = Path(__file__).resolve().parents[1]
"""The checkout that this is of."""


class Measured(Struct, frozen=True):
    """A checkout, its stages alone (none where they could not be measured), and its rounds of the loop."""

    name: str
    alone: StagesAlone | None
    rounds: list[TrainingReport]

    @property
    def speeds(self) -> list[float]:
        """Steps a second of each round."""
        return [report.steps_per_second for report in self.rounds]

    @property
    def speed(self) -> float:
        """The median of the rounds'."""
        return statistics.median(self.speeds)


class Checkout(Struct, frozen=True):
    """A checkout of Vantage, whose own rooms run."""

    name: str
    directory: Path

    def stages_alone(self, options: Sequence[str]) -> StagesAlone | None:
        """By our means, on its rooms; None where its rooms are too far from ours."""
        try:
            return msgspec.json.decode(self._run(str(stages_alone.__file__), *options), type=StagesAlone)
        except subprocess.CalledProcessError:
            return None

    def loop(self, config: Path) -> TrainingReport:
        """The summary of a training."""
        with tempfile.TemporaryDirectory() as directory:
            command = ("-m", "orchestrator", "train", str(config), "--json", "--no-evaluate")
            return msgspec.json.decode(self._run(*command, "--run", f"{directory}/run"), type=TrainingReport)

    def _run(self, *command: str) -> bytes:
        """The output of an interpreter that imports this checkout's modules before any others."""
        path = os.pathsep.join(filter(None, (str(self.directory), os.environ.get("PYTHONPATH"))))
        # Safe path: else a script's own folder would come before all of these.
        environment = os.environ | {"PYTHONPATH": path, "PYTHONSAFEPATH": "1"}
        command = (sys.executable, *command)
        return subprocess.run(command, cwd=self.directory, env=environment, stdout=subprocess.PIPE, check=True).stdout


def measure(checkouts: Sequence[Checkout], rounds: int, config: Path, alone: Sequence[str]) -> list[Measured]:
    """The stages alone of every checkout, then rounds of their loops in turns; who goes first changes each time."""
    found = [Measured(one.name, one.stages_alone(alone), []) for one in checkouts]
    errors = Console(stderr=True)
    turns = list(zip(checkouts, found, strict=True))
    for number in range(rounds):
        for checkout, measured in turns if number % 2 == 0 else reversed(turns):
            errors.print(f"round {number + 1} of {rounds}: {checkout.name}", markup=False)
            measured.rounds.append(checkout.loop(config))
    return found


def bound(alone: StagesAlone, cores: int) -> float:
    """Steps a second of cores that do nothing but the stages, each as quickly as alone."""
    return cores / _seconds_a_step(alone)


def _seconds_a_step(alone: StagesAlone) -> float:
    """Each stage once, and gradient updates as often as a step makes them."""
    weight = {"learn": alone.updates_per_step}
    return sum(weight.get(stage, 1.0) * seconds for stage, seconds in alone.seconds.items())


def stage_table(alone: Mapping[Stage, float], loop: Mapping[Stage, Any]) -> str:
    """Milliseconds of each stage, and its share of the sum of all stages alone."""
    total = sum(alone.values())
    rows = [
        f"| {stage} | {1e3 * alone[stage]:.2f} | {alone[stage] / total:.1%} | {1e3 * (loop[stage] or 0.0):.2f} |"
        for stage in STAGES
    ]
    head = ["| stage | alone, ms | share | in the loop, ms |", "|---|---:|---:|---:|"]
    return "\n".join([*head, *rows, f"| sum | {1e3 * total:.1f} | 100% | |"])


def stages_in_the_loop(rounds: Sequence[TrainingReport]) -> dict[Stage, float]:
    """The median of the rounds' medians; 0 for a stage that none has measured."""
    found: dict[Stage, float] = {}
    for stage in STAGES:
        met = [seconds for one in rounds if (seconds := one.stages.get(stage)) is not None]
        found[stage] = statistics.median(met) if met else 0.0
    return found


def rounds_table(own: Measured, other: Measured) -> str:
    """Steps a second of each round, and how many times the other's ours are."""
    pairs = [*zip(own.speeds, other.speeds, strict=True), (own.speed, other.speed)]
    names = [*(str(number + 1) for number in range(len(own.rounds))), "median"]
    rows = [
        f"| {name} | {ours:.2f} | {theirs:.2f} | {ours / theirs:.3f} |"
        for name, (ours, theirs) in zip(names, pairs, strict=True)
    ]
    head = [f"| round | {own.name}, steps/s | {other.name}, steps/s | ratio |", "|---|---:|---:|---:|"]
    return "\n".join([*head, *rows])


def loop_lines(measured: Measured, cores: int) -> str:
    """The throughput of the loop, and its share of the bound."""
    rounds, alone = measured.rounds, measured.alone
    speeds = ", ".join(f"{speed:.2f}" for speed in measured.speeds)
    said = (
        f"the loop: {rounds[0].steps} steps at {speeds} steps/s, {sum(one.retries for one in rounds)} retries, "
        f"{sum(one.late_replies for one in rounds)} late replies"
    )
    if alone is None:
        return f"{said}\nthe bound is not known: the stages alone could not be measured"
    limit = bound(alone, cores)
    return (
        f"{said}\nthe bound: {cores} cores ÷ {1e3 * _seconds_a_step(alone):.1f} ms = {limit:.2f} steps/s, with "
        f"{alone.updates_per_step:g} updates a step; the loop reaches {measured.speed / limit:.1%} of it"
    )


def print_all(console: Console, found: Sequence[Measured], cores: int) -> None:
    """The machine, every checkout's stages, and the rounds where there are two."""
    console.print(f"machine: {machine_kind()}; this process may use {cores} cores", markup=False)
    for measured in found:
        if len(found) > 1:
            console.print(f"\n{measured.name}:", markup=False)
        if measured.alone is not None:
            table = stage_table(measured.alone.seconds, stages_in_the_loop(measured.rounds))
            console.print(f"\n{table}", markup=False)
        console.print(f"\n{loop_lines(measured, cores)}", markup=False)
    if len(found) > 1:
        console.print(f"\n{rounds_table(found[0], found[1])}", markup=False)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.loop", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add_options(parser)
    parser.add_argument("--against", type=Path, metavar="DIRECTORY", help="another checkout, to take turns with")
    parser.add_argument("--rounds", type=int, help="of the loop (default: 3 with --against, else 1)")
    options = parser.parse_args(arguments)
    checkouts = [Checkout("this checkout", OWN)]
    if options.against:
        directory = options.against.resolve(strict=True)
        checkouts.append(Checkout(directory.name, directory))
    rounds = options.rounds or (3 if options.against else 1)
    alone = ("--config", str(options.config), "--requests", str(options.requests))
    found = measure(checkouts, rounds, options.config, alone)
    print_all(Console(soft_wrap=True), found, available_cores())


if __name__ == "__main__":
    main()
