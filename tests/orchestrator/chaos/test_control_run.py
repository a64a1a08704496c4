import msgspec
import pytest

from orchestrator.chaos.control_run import control_run, identity
from orchestrator.chaos.errors import RehearsalFailed
from orchestrator.errors import RunBusy
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.run_directory import RunDirectory
from protocol.config import RunConfig
from protocol.errors import Interrupted
from protocol.records import Phase, Progress, Summary
from protocol.system.stop_request import StopRequest

CONFIG = RunConfig(seed=5)
SUMMARY = Summary(
    steps=100, episodes=1, updates=0, seconds=9.0, steps_per_second=9.0, stages={}, late_replies=0, retries=0
)


@pytest.fixture
def directory(tmp_path, versions):
    """A run where the control run of the configuration belongs."""
    return RunDirectory.create(tmp_path / "runs" / f"control-{identity(CONFIG)}", CONFIG, versions)


@pytest.fixture
def ask(tmp_path):
    """Asks for the control run; if one is flown, this stops it at once."""

    def ask():
        path, stop = tmp_path / "c.toml", StopRequest()
        path.write_bytes(resolved_toml(CONFIG))
        return control_run(path, CONFIG, tmp_path / "runs", stop, lambda _: stop.ask())

    return ask


def complete(directory, *phases: tuple[Phase, int]):
    (directory.path / "summary.json").write_bytes(msgspec.json.encode(SUMMARY))
    with directory.progress_path.open("ab") as file:
        for phase, step in phases:
            record = Progress(time=1.0, phase=phase, step=step, steps=step, episodes=0, steps_per_second=8.0)
            file.write(msgspec.json.encode(record) + b"\n")


def test_a_run_that_is_whole_is_used_again(directory, ask):
    complete(directory, ("prefill", 40), ("training", 100), ("done", 100))
    found = ask()
    assert (found.directory, found.steps, found.reused) == (directory, 140, True)


def test_a_run_that_was_interrupted_is_flown_anew(directory, ask):
    with pytest.raises(Interrupted):
        ask()
    assert not directory.config_path.exists()


@pytest.mark.slow
def test_a_run_that_another_rehearsal_makes_is_left_alone(directory, ask):
    with directory.lock(), pytest.raises(RunBusy):
        ask()
    assert directory.config_path.exists()


def test_a_run_whose_progress_does_not_reach_its_end_is_refused(directory, ask):
    complete(directory, ("training", 90))
    with pytest.raises(RehearsalFailed, match="has ended before its training was done"):
        ask()


def test_another_configuration_needs_another_run():
    assert identity(CONFIG) == identity(RunConfig(seed=5))
    assert identity(CONFIG) != identity(RunConfig(seed=6))
