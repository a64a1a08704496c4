"""The wall clock is set while a run goes on: by hours, either way. Nothing comes of it.

No test may set the machine's own clock. What its processes see of it when it is set are two things: the time, and the
time of the boot that Linux computes from it anew, as told by `/proc/stat`. These are set for the processes of one run.
"""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import psutil
import pytest

from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.run_directory import RunDirectory
from orchestrator.supervision.heartbeat import is_alive
from orchestrator.supervision.process_handle import AdoptedProcess, creation_time
from protocol.messages import Role
from protocol.system.process_start import own_start
from tests.orchestrator.conftest import Command, processes_in

CLOCK = str(Path(__file__).parent / "clock_that_is_set")
MOUNTED = 'mount --bind "$0" /proc/stat && exec "$@"'
HOUR = 3600.0
CONFIG = """
[timeouts]
heartbeat = 0.1
liveness = 2.0
startup = 20.0

[training]
steps = 100000
"""
PATIENCE = 60.0


class SetClock:
    """The wall clock of the processes that are started under it."""

    def __init__(self, folder: Path) -> None:
        self._offset, self.boot = folder / "offset", folder / "stat"
        self._told = Path("/proc/stat").read_text()
        self.set(0.0)

    def set(self, seconds: float) -> None:
        """Have it be so many seconds later than it is."""
        boot = next(line for line in self._told.splitlines() if line.startswith("btime "))
        told = self._told.replace(boot, f"btime {int(boot.split()[1]) + int(seconds)}")
        # Into the file that is mounted: another one of its name would not be.
        self.boot.write_text(told)
        self._offset.write_text(str(seconds))

    @property
    def environment(self) -> dict[str, str]:
        path = os.pathsep.join(filter(None, [CLOCK, os.environ.get("PYTHONPATH")]))
        return {"CLOCK_OFFSET": str(self._offset), "PYTHONPATH": path}


@pytest.fixture
def clock(tmp_path):
    set_clock = SetClock(tmp_path)
    mounting = ["unshare", "--mount", "sh", "-c", MOUNTED, str(set_clock.boot), "cat", "/proc/stat"]
    try:
        told = subprocess.run(mounting, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip("not run: there is no unshare")
    if told.stdout != set_clock.boot.read_text():
        pytest.skip(f"not run: no right to mount in a namespace of one's own: {told.stderr}")
    return set_clock


class Run:
    """A training under a clock that is set, and what `orchestrator status` says of it."""

    def __init__(self, command: Command, clock: SetClock, monkeypatch) -> None:
        self.command, self.clock = command, clock
        self.directory = RunDirectory(command.folder / "one")
        self._children: list[subprocess.Popen[str]] = []
        monkeypatch.setenv("CLOCK_OFFSET", clock.environment["CLOCK_OFFSET"])
        monkeypatch.setenv("PYTHONPATH", clock.environment["PYTHONPATH"])
        (command.folder / "short.toml").write_text(CONFIG)

    def start(self, *arguments: str) -> subprocess.Popen[str]:
        """The command where the clock is set."""
        return self.command.start(*arguments, before=("unshare", "--mount", "sh", "-c", MOUNTED, str(self.clock.boot)))

    def status(self) -> dict:
        child = self.start("status", "one", "--json")
        out, err = child.communicate(timeout=PATIENCE)
        assert child.returncode == 0, err
        return json.loads(out)

    def pids(self) -> dict[str, int]:
        return {process.name: process.pid for process in self.directory.processes()}

    def wait_until(self, condition) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "what was waited for did not happen"
            time.sleep(0.05)

    def step(self) -> int:
        progress = self.directory.progress()
        return progress.step if progress else 0

    def goes_on_for(self, seconds: float) -> None:
        """For longer than anybody may be silent or stand still."""
        before, ends = self.step(), time.monotonic() + seconds
        self.wait_until(lambda: time.monotonic() >= ends and self.step() > before)


@pytest.fixture
def run(tmp_path_factory, clock, monkeypatch):
    command = Command(tmp_path_factory.mktemp("o"))
    yield Run(command, clock, monkeypatch)
    for process in processes_in(command.folder):
        process.kill()
    for child in command.children:
        child.communicate(timeout=PATIENCE)


@pytest.mark.slow
def test_a_clock_that_is_set_either_way_costs_a_run_nothing(run):
    child = run.start("train", "short.toml", "--run", "one", "--no-evaluate")
    run.wait_until(lambda: run.step() > 0 or child.poll() is not None)
    assert child.poll() is None, child.communicate()[1]
    before = run.pids()
    for seconds in (2.0, -HOUR, 12 * HOUR):
        run.clock.set(seconds)
        run.goes_on_for(5.0)
        status = run.status()
        assert (status["state"], status["restarts"]) == ("running", {})
        assert {worker["state"] for worker in status["workers"]} <= {"ready", "busy", "running"}
    assert (run.pids(), run.directory.restarts()) == (before, ())


@pytest.mark.slow
def test_processes_are_taken_up_after_the_clock_was_set_and_one_that_hangs_is_still_found(run):
    child = run.start("train", "short.toml", "--run", "one", "--no-evaluate")
    run.wait_until(lambda: run.step() > 0 or child.poll() is not None)
    before = run.pids()
    child.kill()
    child.communicate(timeout=PATIENCE)
    run.clock.set(-3 * HOUR)
    assert run.status()["state"] == "abandoned"
    resumed = run.start("resume", "one")
    run.wait_until(lambda: run.directory.is_busy() or resumed.poll() is not None)
    run.goes_on_for(5.0)
    assert (run.pids(), run.directory.restarts()) == (before, ())
    os.kill(before["agent"], signal.SIGSTOP)
    run.wait_until(lambda: bool(run.directory.restarts()))
    assert run.directory.restarts()[0].process == "agent"
    assert resumed.poll() is None


def record(**more) -> ProcessRecord:
    us = os.getpid()
    return ProcessRecord(
        **{"name": "agent", "role": Role.AGENT, "address": None, "pid": us, "log": "logs/agent.jsonl", **more}
    )


def test_whoever_is_written_down_with_ticks_is_known_whatever_the_clock_said(monkeypatch):
    ours = record(started=creation_time(os.getpid()) - HOUR, started_at=own_start())
    assert is_alive(ours)
    adopted = AdoptedProcess(psutil.Process())
    monkeypatch.setattr(psutil, "boot_time", lambda: 0.0)
    monkeypatch.setattr(time, "time", lambda: HOUR)
    assert is_alive(ours)
    assert adopted.is_running


def test_a_later_process_of_the_number_is_another_though_the_clock_says_the_same():
    start = own_start()
    assert start is not None
    assert not is_alive(record(started=creation_time(os.getpid()), started_at=type(start)(start.boot, start.ticks - 1)))
    assert not is_alive(record(started=creation_time(os.getpid()), started_at=type(start)("another", start.ticks)))


def test_a_record_of_before_ticks_were_written_down_is_read_and_goes_by_the_clock(run_with_old_record):
    (process,) = run_with_old_record.processes()
    assert process.started_at is None
    assert is_alive(process)


@pytest.fixture
def run_with_old_record(tmp_path):
    old = {
        "name": "agent",
        "role": "agent",
        "address": None,
        "pid": os.getpid(),
        "started": creation_time(os.getpid()) + 1.0,
        "log": "logs/agent.jsonl",
    }
    (tmp_path / "workers.json").write_text(json.dumps([old]))
    return RunDirectory(tmp_path)
