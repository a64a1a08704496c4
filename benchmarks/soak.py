"""An hour of training under faults: whether it continues, and whether the memory of a process grows.

    python -m benchmarks.soak --minutes 60

Faults of every class strike at random moments, one every 20 s on average, whether the run has recovered from the one
before or not. Prints a Markdown table: a line through the memory of each process, over all processes of its name, once
against the time of the soak, and once against the process' own age, of those that lived long enough for their caches to
be full.
"""

import argparse
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path

import msgspec
import numpy as np
import psutil
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from benchmarks.machine import machine_kind
from orchestrator.chaos.errors import NotRecovered
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.catalogue import chosen
from orchestrator.chaos.schedule import plan, strike_times
from orchestrator.chaos.settings import rehearsal_config
from orchestrator.monitoring.live_display import Display, Snapshot, open_display
from orchestrator.run.config_toml import resolved_toml
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.system.process_start import process_start
from protocol.system.stop_request import StopRequest, stop_on_signals

SAMPLE_EVERY = 5.0
LOADING = 15.0
"""Seconds of a process's life that are left out: it is still loading."""
GROWN_UP = 180.0
"""Seconds after which a process' caches (of scenes, of textures) are full."""
CHECKPOINT_EVERY = 100
"""Steps; agents live for less than a minute here, and have to come to their next checkpoint."""
ENDLESS = 10**8
MIB = 2**20


class Sample(Struct, frozen=True):
    """The memory of one process: seconds since the soak began and since the process did, and bytes."""

    name: str
    time: float
    age: float
    resident: int


class Memory:
    """Looks at every process of a run now and then, while it is watched."""

    def __init__(self, display: Display) -> None:
        self.samples: list[Sample] = []
        self.activity = "starting"
        self._display = display
        self._begun = time.monotonic()
        self._next = 0.0

    @property
    def elapsed(self) -> float:
        """Seconds since the soak began."""
        return time.monotonic() - self._begun

    def __call__(self, run: RehearsedRun) -> None:
        """Show how the run is, and take samples when it is time."""
        self._display.show(Snapshot(activity=self.activity, elapsed=self.elapsed, progress=run.progress.last))
        if self.elapsed >= self._next:
            self._next = self.elapsed + SAMPLE_EVERY
            for process in run.children.alive():
                self._take(process.name, process.pid)
            if run.orchestrator_pid is not None:
                self._take("orchestrator", run.orchestrator_pid)

    def _take(self, name: str, pid: int) -> None:
        try:
            process = psutil.Process(pid)
            started = process_start(pid)
            if started is not None and started.age > LOADING:
                self.samples.append(Sample(name, self.elapsed, started.age, process.memory_info().rss))
        except psutil.NoSuchProcess:
            return


class Line(Struct, frozen=True):
    """A straight line through samples: MiB an hour with its standard error, and the median in MiB."""

    slope: float
    error: float
    median: float
    samples: int


def fit(samples: Sequence[Sample], against: Callable[[Sample], float]) -> Line | None:
    """By least squares against seconds; None for too few samples to tell an error from."""
    if len(samples) < 4:
        return None
    hours = np.array([against(sample) for sample in samples]) / 3600
    mib = np.array([sample.resident for sample in samples]) / MIB
    coefficients, covariance = np.polyfit(hours, mib, 1, cov=True)
    return Line(
        slope=float(coefficients[0]),
        error=float(np.sqrt(covariance[0, 0])),
        median=statistics.median(mib.tolist()),
        samples=len(samples),
    )


def soak(run: RehearsedRun, memory: Memory, *, minutes: float, every: float, seed: int) -> Counter[str]:
    """Train for so long under a fault every so many seconds on average; says how often each class struck."""
    scenarios = chosen(())
    moments = strike_times(seed, every, 60 * minutes)
    planned = plan(seed, len(moments), tuple(scenarios), ENDLESS, drones=1)
    struck: Counter[str] = Counter()
    run.begin()
    run.wait(lambda: run.progress.step > 0, "the training began")
    for moment, fault in zip(moments, planned, strict=True):
        memory.activity = f"waiting for fault {struck.total() + 1} of about {len(moments)}, {fault.scenario}"
        run.sleep(max(0.0, moment - memory.elapsed))
        scenario = scenarios[fault.scenario](fault.chance)
        try:
            scenario.setup(run)
            scenario.fault(run)
        except NotRecovered as error:
            struck[f"{fault.scenario} (not: {error})"] += 1
        else:
            struck[fault.scenario] += 1
        if memory.elapsed > 60 * minutes:
            break
    run.sleep(max(0.0, 60 * minutes - memory.elapsed))
    return struck


def endless(config: RunConfig) -> RunConfig:
    """The configuration for a training that does not end by itself."""
    training = replace(config.training, steps=ENDLESS, checkpoint_every=CHECKPOINT_EVERY)
    return rehearsal_config(replace(config, training=training), faults=1, steps=ENDLESS)


def table(memory: Memory, restarts: dict[str, int]) -> str:
    """One row a process."""
    rows = [
        "| process | restarts | samples | median, MiB | by time, MiB/hour | older than 3 min | by age, MiB/hour |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for name in sorted({sample.name for sample in memory.samples}):
        of_name = [sample for sample in memory.samples if sample.name == name]
        grown_up = [sample for sample in of_name if sample.age > GROWN_UP]
        line, growth = fit(of_name, lambda sample: sample.time), fit(grown_up, lambda sample: sample.age)
        if line is not None:
            figures = f"{line.samples} | {line.median:.0f} | {_slope(line)} | {len(grown_up)} | {_slope(growth)}"
            rows.append(f"| {name} | {restarts.get(name, 0)} | {figures} |")
    return "\n".join(rows)


def _slope(line: Line | None) -> str:
    return f"{line.slope:+.1f} ± {line.error:.1f}" if line else "too few"


def main(arguments: Sequence[str] | None = None) -> None:
    """Soak and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=__doc__)
    parser.add_argument("--config", type=Path, default=Path("configs/quickstart.toml"))
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--every", type=float, default=20.0, help="seconds between two faults, on average")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--samples", type=Path, help="write every sample there as well, as JSON lines")
    parser.add_argument("--folder", type=Path, help="keep the run and its logs there (default: they are removed)")
    options = parser.parse_args(arguments)
    console = Console(soft_wrap=True)
    settings = endless(load_config(options.config))
    with (
        nullcontext(options.folder) if options.folder else tempfile.TemporaryDirectory() as folder,
        stop_on_signals() as stop,
        open_display(Console(stderr=True)) as display,
    ):
        _soak_in(Path(folder), settings, options, stop, Memory(display), console)


def _soak_in(
    folder: Path, settings: RunConfig, options: argparse.Namespace, stop: StopRequest, memory: Memory, console: Console
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    config_path = folder / "soak.toml"
    config_path.write_bytes(resolved_toml(settings))
    with RehearsedRun(config_path, folder / "run", settings.timeouts, stop, memory) as run:
        struck = soak(run, memory, minutes=options.minutes, every=options.every, seed=options.seed)
        run.stop_in_order()
        restarts = run.children.restarts | {"orchestrator": run.resumes}
    if options.samples is not None:
        options.samples.write_bytes(msgspec.json.Encoder().encode_lines(memory.samples))
    console.print(f"machine: {machine_kind()}")
    console.print(f"{struck.total()} faults in {memory.elapsed / 60:.0f} minutes, {run.progress.step} steps trained\n")
    console.print(table(memory, restarts), markup=False)
    console.print("\n" + ", ".join(f"{name} {count}" for name, count in sorted(struck.items())), markup=False)


if __name__ == "__main__":
    main()
