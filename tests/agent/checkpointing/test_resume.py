"""Setup → Fault → Recovery → Invariant: a training killed at any moment ends as one that never was."""

import itertools
import json
import random
import shutil
import signal
from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest
from msgspec.structs import replace

from agent.checkpointing.checkpoint import read_checkpoint
from agent.errors import JournalDamaged, NewerFormat, NoWholeCheckpoint, OtherConfig, ResumeRefused, RunInUse
from protocol.config import RunConfig, TrainingConfig
from protocol.environment_config import EnvironmentConfig
from protocol.errors import WorkerLost
from protocol.failpoint import Failpoints
from protocol.learner_config import LearnerConfig, PpoConfig, SacConfig
from protocol.records import Summary
from tests.agent.analytic_sensor import TIMING, AnalyticSensor
from tests.agent.checkpointing.comparison import curves, differing
from tests.agent.checkpointing.full_disk import no_file_larger_than
from tests.agent.checkpointing.killing import train_until
from tests.agent.trainings import trained

PLACES = (
    "checkpoint-opened",
    "checkpoint-journal-synced",
    "checkpoint-written",
    "checkpoint-manifest-written",
    "checkpoint-renamed",
    "checkpoint-pruned",
)

SAC = RunConfig(
    seed=3,
    environment=EnvironmentConfig(num_envs=2, episode_steps=5),
    learner=LearnerConfig(sac=SacConfig(hidden_sizes=(16,), buffer_size=40, batch_size=8, updates_per_step=0.5)),
    training=TrainingConfig(steps=60, prefill=20, log_every=12, checkpoint_every=14, keep_checkpoints=2),
)
"""The memory of 20 steps of two drones has begun anew by the end."""

PPO = replace(
    SAC, learner=LearnerConfig(algorithm="ppo", ppo=PpoConfig(hidden_sizes=(16,), n_steps=6, n_epochs=1, minibatches=2))
)
pytestmark = pytest.mark.slow

BOTH = pytest.mark.parametrize("config", [SAC, PPO], ids=["sac", "ppo"])


@pytest.fixture(scope="module")
def control_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[RunConfig], Path]:
    """The run directory of a training that nothing happened to."""
    runs: dict[str, Path] = {}

    def run_of(config: RunConfig) -> Path:
        name = config.learner.algorithm
        if name not in runs:
            runs[name] = tmp_path_factory.mktemp(name) / "run"
            trained(runs[name], config)
        return runs[name]

    return run_of


def stopped_after(steps: int) -> Callable[[], bool]:
    """A request to stop that comes after so many steps of all drones."""
    left = iter(range(steps))
    return lambda: next(left, None) is None


@BOTH
@pytest.mark.parametrize("steps", [0, 4, 9, 10, 13, 14, 22, 29])
def test_a_training_stopped_and_gone_on_with_ends_the_same(tmp_path, control_run, config, steps: int) -> None:
    run = tmp_path / "run"
    summary = trained(run, config, stop=stopped_after(steps))
    assert not summary.complete
    assert trained(run, config).complete
    assert differing(run, control_run(config)) == set()


def test_a_training_stopped_again_and_again_ends_the_same(tmp_path, control_run) -> None:
    run = tmp_path / "run"
    while not trained(run, SAC, stop=stopped_after(3)).complete:
        pass
    assert differing(run, control_run(SAC)) == set()


@BOTH
def test_a_training_killed_at_random_pictures_ends_the_same(tmp_path, control_run, config) -> None:
    run, rng = tmp_path / "run", random.Random(7)
    kills = 0
    while (code := train_until(run, config, look=rng.randrange(10, 40))) != 0:
        assert code == -signal.SIGKILL
        kills += 1
    assert kills >= 3
    assert differing(run, control_run(config)) == set()


@BOTH
@pytest.mark.parametrize("place", PLACES)
def test_a_training_killed_while_it_writes_a_checkpoint_ends_the_same(
    tmp_path, control_run, config, place: str
) -> None:
    run, points = tmp_path / "run", Failpoints(tmp_path / "failpoints")
    trained(run, config, stop=stopped_after(9))
    points.order(place, "kill")
    assert train_until(run, config, failpoints=tmp_path / "failpoints") == -signal.SIGKILL
    assert not points.is_pending(place)
    assert all(read_checkpoint(path) for path in (run / "checkpoints").glob("step-*")), "whole or not there"
    assert train_until(run, config) == 0
    assert differing(run, control_run(config)) == set()
    assert not list((run / "checkpoints").glob(".*")), "nothing is left aside"


@pytest.mark.parametrize("place", PLACES)
def test_a_training_killed_at_its_first_checkpoint_ends_the_same(tmp_path, control_run, place: str) -> None:
    run, points = tmp_path / "run", Failpoints(tmp_path / "failpoints")
    points.order(place, "kill")
    assert train_until(run, SAC, failpoints=tmp_path / "failpoints") == -signal.SIGKILL
    assert train_until(run, SAC) == 0
    assert differing(run, control_run(SAC)) == set()


def test_a_training_that_is_complete_only_says_so_again(tmp_path, control_run) -> None:
    run = tmp_path / "run"
    shutil.copytree(control_run(SAC), run)
    before = sorted((run / "checkpoints").iterdir())
    summary = msgspec.json.decode((run / "summary.json").read_bytes(), type=Summary)
    (run / "weights.safetensors").unlink()
    (run / "summary.json").unlink()
    again = trained(run, SAC)
    assert (again.complete, again.steps, again.seconds) == (True, summary.steps, summary.seconds)
    assert differing(run, control_run(SAC)) == set()
    assert sorted((run / "checkpoints").iterdir()) == before


def test_a_run_may_be_made_longer(tmp_path, control_run) -> None:
    run = tmp_path / "run"
    trained(run, replace(SAC, training=replace(SAC.training, steps=30)))
    trained(run, SAC)
    assert differing(run, control_run(SAC)) == set()


def test_seconds_and_calls_are_those_of_all_processes(tmp_path, control_run) -> None:
    run = tmp_path / "run"
    first, second = trained(run, SAC, stop=stopped_after(22)), trained(run, SAC)
    assert second.seconds > first.seconds > 0
    assert (first.retries, second.retries, second.late_replies) == (1, 2, 4)
    assert set(second.stages) == {"render", "infer", "transport", "learn"}


def test_curves_have_no_point_twice(tmp_path, control_run) -> None:
    """Points are drawn after the last checkpoint, and again when the training goes on from it."""
    run = tmp_path / "run"
    trained(run, SAC, stop=stopped_after(20))
    for path in sorted((run / "checkpoints").iterdir())[-1:]:
        shutil.rmtree(path)
    trained(run, SAC)
    steps = [step for step, _ in curves(run)["Flights / Mean return"]]
    assert steps == sorted(set(steps))
    assert curves(run) == curves(control_run(SAC))


# TensorBoard's own thread ends with the error, after it has told us.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_full_disk_costs_checkpoints_and_nothing_else(tmp_path, control_run, caplog) -> None:
    run = tmp_path / "run"
    trained(run, SAC, stop=stopped_after(9))
    before = sorted((run / "checkpoints").iterdir())
    asked = iter(range(100))

    def stop() -> bool:
        if next(asked) == 20:
            disk.__exit__(None, None, None)
            assert sorted((run / "checkpoints").iterdir()) == before, "no checkpoint, and nothing left aside"
        return False

    disk = no_file_larger_than(100)
    disk.__enter__()
    assert trained(run, SAC, stop=stop).complete
    assert "no checkpoint after 28 steps" in caplog.text
    assert differing(run, control_run(SAC)) - {"curves"} == set()


def damaged(run: Path, name: str) -> None:
    path = max((run / "checkpoints").glob("step-*")) / name
    path.write_bytes(path.read_bytes()[:-3] + b"abc")


@pytest.mark.parametrize("name", ["manifest.json", "weights.safetensors", "state.safetensors", "state.msgpack"])
def test_a_damaged_checkpoint_is_reported_and_passed_over(tmp_path, control_run, caplog, name: str) -> None:
    run = tmp_path / "run"
    trained(run, SAC, stop=stopped_after(22))
    newest = max((run / "checkpoints").glob("step-*"))
    damaged(run, name)
    assert trained(run, SAC).complete
    assert f"passed over the damaged checkpoint {newest.name}" in caplog.text
    assert name in caplog.text
    assert differing(run, control_run(SAC)) == set()


def test_two_trainings_at_once_are_refused_the_second_one(tmp_path, control_run) -> None:
    run, refused = tmp_path / "run", []

    def stop() -> bool:
        if not refused:
            before = everything(run)
            with pytest.raises(RunInUse, match=str(run)):
                trained(run, SAC)
            refused.append(everything(run) == before)
        return False

    trained(run, SAC, stop=stop)
    assert refused == [True]


def lost_at(look: int) -> AnalyticSensor:
    """Sensor whose workers are gone from a picture on."""
    requests = itertools.count(1)

    def deliver(pending, observation) -> None:
        if next(requests) < look:
            pending.succeed(observation, TIMING)
        else:
            pending.fail(WorkerLost("gone"), TIMING)

    return AnalyticSensor(deliver)


@BOTH
@pytest.mark.parametrize("look", [3, 20, 21, 45, 60])
def test_a_training_whose_workers_are_lost_in_a_step_goes_on_with_that_step(
    tmp_path, control_run, config, look: int
) -> None:
    run = tmp_path / "run"
    with pytest.raises(WorkerLost):
        trained(run, config, sensor=lost_at(look))
    with pytest.raises(WorkerLost):
        trained(run, config, sensor=lost_at(1))
    assert trained(run, config).complete
    assert differing(run, control_run(config)) == set()


def test_workers_that_are_lost_after_a_request_to_stop_make_no_failure(tmp_path, control_run) -> None:
    run, sensor = tmp_path / "run", lost_at(40)
    stopped = trained(run, SAC, sensor=sensor, stop=lambda: sensor.requests >= 40)
    assert not stopped.complete
    assert trained(run, SAC).complete
    assert differing(run, control_run(SAC)) == set()


def everything(run: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}


def newer_format(run: Path) -> None:
    for path in (run / "checkpoints").glob("*/manifest.json"):
        path.write_text(json.dumps({"format": 2, "whatever": "comes"}))


def no_segment(run: Path) -> None:
    (run / "replay" / "000000.bin").unlink()


def segment_cut_off(run: Path) -> None:
    path = run / "replay" / "000000.bin"
    path.write_bytes(path.read_bytes()[:-1])


def episodes_written_to(run: Path) -> None:
    path = run / "episodes.jsonl"
    path.write_bytes(path.read_bytes().replace(b"scripted", b"somebody", 1))


def all_damaged(run: Path) -> None:
    for path in (run / "checkpoints").glob("*/state.msgpack"):
        path.write_bytes(b"")


@pytest.mark.parametrize(
    ("spoil", "config", "error", "words"),
    [
        (newer_format, SAC, NewerFormat, r"manifest\.json has the format 2"),
        (lambda run: None, replace(SAC, seed=4), OtherConfig, "seed was 3, is 4"),
        (lambda run: None, PPO, OtherConfig, r"learner\.algorithm was 'sac', is 'ppo'"),
        (no_segment, SAC, JournalDamaged, r"000000\.bin is missing"),
        (segment_cut_off, SAC, JournalDamaged, r"000000\.bin has \d+ bytes of"),
        (episodes_written_to, SAC, JournalDamaged, r"episodes\.jsonl is not what was written"),
        (all_damaged, SAC, NoWholeCheckpoint, "all checkpoints in .* are damaged"),
    ],
)
def test_what_can_not_be_gone_on_with_is_refused_by_name_and_left_alone(
    tmp_path, spoil: Callable[[Path], None], config: RunConfig, error: type[ResumeRefused], words: str
) -> None:
    run = tmp_path / "run"
    trained(run, SAC, stop=stopped_after(22))
    (run / "checkpoints" / ".step-000000050.left").mkdir()
    spoil(run)
    before = everything(run)
    with pytest.raises(error, match=words):
        trained(run, config)
    assert everything(run) == before
    assert (run / "checkpoints" / ".step-000000050.left").exists()
