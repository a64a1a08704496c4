"""Measurements as processes of their own: one that fails, or takes too long, costs its own row."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec
from msgspec import Struct
from rich.console import Console

from benchmarks.accelerator.measured import Measured
from benchmarks.accelerator.places import Place
from orchestrator.report import TrainingReport


class Missing(Struct, frozen=True):
    """Why something could not be measured."""

    reason: str


class Jobs:
    """Runs measurements until the time is up.

    Args:
        directory: where arrays are kept.
        seconds: for all of them together.
        longest: seconds for one.
        anything: whether what turns out to be no GPU counts as one, to try the command out.
    """

    def __init__(
        self,
        directory: Path,
        errors: Console,
        *,
        seconds: float,
        longest: float = 90.0,
        anything: bool = False,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._directory = directory
        self._errors = errors
        self._clock = clock
        self._end = clock() + seconds
        self._longest = longest
        self._anything = anything

    def arrays(self, name: str) -> Path:
        """The file of what a measurement of this name gave."""
        return self._directory / f"{name}.npz"

    def measure(self, name: str, module: str, place: Place, *options: str) -> Measured | Missing:
        """What `benchmarks.accelerator.<module>` finds at a place."""
        command = ("-m", f"benchmarks.accelerator.{module}", "--arrays", str(self.arrays(name)), *options)
        found = self._output(name, place, command)
        if isinstance(found, Missing):
            return found
        # Libraries may have said something before.
        measured = msgspec.json.decode(found.splitlines()[-1], type=Measured)
        if place.name == "GPU" and not measured.on_gpu and not self._anything:
            return Missing(f"it would be {measured.device}, which is no GPU")
        return measured

    def train(self, name: str, place: Place, config: str) -> TrainingReport | Missing:
        """What a training says of itself at its end."""
        file = self._directory / f"{name}.toml"
        file.write_text(config)
        with tempfile.TemporaryDirectory() as run:
            command = ("-m", "orchestrator", "train", str(file), "--json", "--no-evaluate", "--run", f"{run}/run")
            found = self._output(name, place, command)
        return found if isinstance(found, Missing) else msgspec.json.decode(found, type=TrainingReport)

    def _output(self, name: str, place: Place, command: Sequence[str]) -> bytes | Missing:
        left = min(self._longest, self._end - self._clock())
        if left < 1.0:
            return Missing("no time was left")
        self._errors.print(f"{self._end - self._clock():4.0f} s left  {name}", markup=False, highlight=False)
        environment = os.environ | place.environment
        try:
            done = subprocess.run((sys.executable, *command), env=environment, capture_output=True, timeout=left)
        except subprocess.TimeoutExpired:
            return Missing(f"not through within {left:.0f} s")
        return done.stdout if done.returncode == 0 else Missing(_last_line(done.stderr, done.returncode))


def _last_line(said: bytes, code: int) -> str:
    lines = [line for line in said.decode(errors="replace").splitlines() if line.strip()]
    if not lines:
        return f"it ended with {code} and without a word"
    # An exception's module says nothing to whoever reads the table.
    return re.sub(r"^(\w+\.)+\w+: ", "", lines[-1].strip())
