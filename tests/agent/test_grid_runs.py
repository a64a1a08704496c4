"""Runs on the grid: trained, killed, resumed and evaluated, without a worker."""

from pathlib import Path

import msgspec
import pytest

from agent.commands import evaluate_run, train_run
from agent.connections import WorkerAccess
from protocol.artifact import sha256
from protocol.errors import ArtifactMissing, InvalidInput
from protocol.grid.records import GridEvaluation
from tests.agent.checkpointing.comparison import differing
from tests.agent.environment.grid.tables import table, write_to

CONFIG = """
seed = 5
env_id = "vantage/Grid-v0"
[grid]
table = "{table}"
num_envs = 8
success_threshold = 1.5
curriculum_every = 200
[learner]
algorithm = "recurrent_ppo"
[learner.recurrent_ppo]
lstm_hidden_size = 8
hidden_size = 8
n_steps = 5
minibatches = 2
ent_coef_steps = 500
[training]
steps = 800
log_every = 80
checkpoint_every = 56
"""
NO_WORKERS = WorkerAccess()


class Killed(BaseException):
    """In place of a signal."""


def make_run(directory: Path) -> Path:
    views = write_to(directory / "views.msgpack", table())
    run = directory / "run"
    run.mkdir()
    (run / "config.toml").write_text(CONFIG.format(table=views))
    return run


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return make_run(tmp_path)


def test_a_run_is_trained_and_evaluated_without_workers(run: Path) -> None:
    summary = train_run(run, NO_WORKERS)
    evaluation = evaluate_run(run, NO_WORKERS, episodes=None, names=())
    assert summary is not None
    assert (summary.steps, summary.complete) == (800, True)
    assert summary.updates == 800 // 8 // 5 * 4 * 2 - (4 * 2 if 800 // 8 % 5 == 0 else 0)
    assert evaluation is not None
    names = ["recurrent_ppo", "random", "circle", "greedy", "optimum"]
    assert [(score.policy, score.episodes) for score in evaluation.scores] == [(name, 2 * 360) for name in names]
    details = msgspec.json.decode((run / "grid.json").read_bytes(), type=GridEvaluation)
    assert details.weights == evaluation.weights == sha256(run / "weights.safetensors")
    assert details.by == evaluation.by
    assert details.thresholds[0].threshold == 1.5
    assert 1.1 in [threshold.threshold for threshold in details.thresholds]
    optimum = details.thresholds[0].scores[-1]
    assert (optimum.success.mean, optimum.ratio) == (1.0, 1.0)
    assert (run / "walks.npz").is_file()


def test_a_killed_training_ends_with_the_same_result(tmp_path: Path) -> None:
    straight, killed = (make_run(make_folder(tmp_path / name)) for name in ("straight", "killed"))
    train_run(straight, NO_WORKERS)
    for step in (64, 232, 640):

        def fail(place: str, at: str = f"step-{step}") -> None:
            if place == at:
                raise Killed

        with pytest.raises(Killed):
            train_run(killed, NO_WORKERS, fail)
    train_run(killed, NO_WORKERS)
    assert differing(straight, killed) == set()


def make_folder(path: Path) -> Path:
    path.mkdir()
    return path


def test_a_number_of_episodes_is_refused_where_every_start_is_walked(run: Path) -> None:
    with pytest.raises(InvalidInput, match="every start"):
        evaluate_run(run, NO_WORKERS, episodes=3, names=("random",))


def test_an_unknown_policy_is_named_with_those_that_there_are(run: Path) -> None:
    with pytest.raises(InvalidInput, match=r"'front'.*recurrent_ppo, random, circle, greedy, optimum"):
        evaluate_run(run, NO_WORKERS, episodes=None, names=("front",))


def test_nothing_is_evaluated_before_there_are_weights(run: Path) -> None:
    with pytest.raises(ArtifactMissing, match=r"weights\.safetensors"):
        evaluate_run(run, NO_WORKERS, episodes=None, names=())
