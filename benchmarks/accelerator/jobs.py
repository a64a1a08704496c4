"""Measurements as processes of their own: one that fails, or takes too long, costs its own row."""

import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec
from msgspec import Struct
from rich.console import Console

from benchmarks.accelerator.measured import Measured
from benchmarks.accelerator.places import Place
from orchestrator.monitoring.report import TrainingReport
from protocol.errors import Unavailable


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
        said = self._run(name, place, command)
        if isinstance(said, Missing):
            return said
        # Libraries may have said something before.
        measured = msgspec.json.decode(said.stdout.splitlines()[-1], type=Measured)
        if place.name == "GPU" and not measured.on_gpu and not self._anything:
            return Missing(f"it would be {measured.device}, which is no GPU{_complaint(said.stderr)}")
        return measured

    def train(self, name: str, place: Place, config: str, *, longest: float) -> TrainingReport | Missing:
        """The summary of a training, which is stopped after `longest` seconds."""
        file = self._directory / f"{name}.toml"
        file.write_text(config)
        with tempfile.TemporaryDirectory() as run:
            command = ("-m", "orchestrator", "train", str(file), "--json", "--no-evaluate", "--run", f"{run}/run")
            said = self._ended(name, place, command, longest)
        if isinstance(said, Missing):
            return said
        with suppress(msgspec.DecodeError):
            report = msgspec.json.decode(said.stdout, type=TrainingReport)
            if report.steps:
                return report
        return self._missing(said)

    def _run(self, name: str, place: Place, command: Sequence[str]) -> "_Said | Missing":
        said = self._ended(name, place, command, self._longest)
        return said if isinstance(said, Missing) or said.code == 0 else self._missing(said)

    def _ended(self, name: str, place: Place, command: Sequence[str], longest: float) -> "_Said | Missing":
        left = min(longest, self._end - self._clock())
        if left < 1.0:
            return Missing("no time was left")
        self._errors.print(f"{self._end - self._clock():4.0f} s left  {name}", markup=False, highlight=False)
        return _said((sys.executable, *command), os.environ | place.environment, left)

    def _missing(self, said: "_Said") -> Missing:
        if said.late is not None:
            return Missing(f"not through within {said.late:.0f} s")
        if Unavailable.__name__ not in said.stderr:
            self._errors.print(said.stderr, markup=False, highlight=False)
        return Missing(_last_line(said.stderr, said.code))


class _Said(Struct, frozen=True):
    """A process's output, its exit code, and the seconds after which it was asked to end, if it was."""

    stdout: str
    stderr: str
    code: int
    late: float | None = None


def _said(command: Sequence[str], environment: Mapping[str, str], seconds: float) -> _Said:
    """A process that takes longer is asked to end with all that it started."""
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        late = None
        try:
            written = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            late = seconds
            process.terminate()
            written = _await_end(process)
        stdout, stderr = (text.decode(errors="replace") for text in written)
        return _Said(stdout, _plain(stderr), process.wait(), late)


def _await_end(process: "subprocess.Popen[bytes]", patience: float = 10.0) -> tuple[bytes, bytes]:
    try:
        return process.communicate(timeout=patience)
    except subprocess.TimeoutExpired:
        process.kill()
        return b"", b""


def _plain(text: str) -> str:
    """Without a terminal's colours."""
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


def _complaint(stderr: str) -> str:
    """The reason that a library gave, if any."""
    reasons = re.findall(r"with error: (.+)", stderr)
    return f"; {reasons[-1].strip()}" if reasons else ""


def _last_line(stderr: str, code: int) -> str:
    lines = [line for line in stderr.splitlines() if line.strip()]
    if not lines:
        return f"it ended with {code} and without a word"
    # Readers of the table don't need an exception's module.
    return re.sub(r"^(\w+\.)+\w+: ", "", lines[-1].strip())
