from pathlib import Path

import msgspec
import pytest

from agent.checkpointing.journal import Journal
from agent.commands import EvaluationProgress, EvaluationStopped, evaluate_run, train_run
from agent.connections import WorkerAccess
from agent.logbook import Clocks
from protocol.artifact import sha256
from protocol.errors import ArtifactDamaged, ArtifactMissing, DeadlineExceeded, InvalidConfig, InvalidInput
from protocol.records import Evaluation, Progress
from tests.agent.serving import analytic_workers

CONFIG = """
seed = 5
[timeouts]
startup = 5.0
[environment]
num_envs = 2
episode_steps = 5
[learner.sac]
hidden_sizes = [16]
buffer_size = 200
batch_size = 8
updates_per_step = 0.5
[training]
steps = 20
prefill = 10
[evaluation]
episodes = 3
baselines = ["stay", "front"]
"""


@pytest.fixture
def run(tmp_path: Path) -> Path:
    directory = tmp_path / "run"
    directory.mkdir()
    (directory / "config.toml").write_text(CONFIG)
    return directory


@pytest.mark.slow
def test_a_run_is_trained_and_evaluated_over_sockets(run: Path, tmp_path: Path) -> None:
    with analytic_workers(tmp_path) as workers:
        summary = train_run(run, workers)
        evaluation = evaluate_run(run, workers, episodes=None, names=())
    assert summary is not None
    assert (summary.steps, summary.late_replies, summary.retries) == (20, 0, 0)
    assert summary.stages["transport"] > 0.0
    assert evaluation is not None
    assert evaluation == msgspec.json.decode((run / "evaluation.json").read_bytes(), type=Evaluation)
    assert [(score.policy, score.episodes) for score in evaluation.scores] == [("sac", 3), ("stay", 3), ("front", 3)]
    assert evaluation.weights == sha256(run / "weights.safetensors")


def test_policies_and_episodes_can_be_chosen(run: Path, tmp_path: Path) -> None:
    with analytic_workers(tmp_path) as workers:
        evaluation = evaluate_run(run, workers, episodes=1, names=("random", "circle"))
        again = evaluate_run(run, workers, episodes=1, names=("random",))
    assert evaluation is not None
    assert again is not None
    assert [(score.policy, score.episodes) for score in evaluation.scores] == [("random", 1), ("circle", 1)]
    assert (evaluation.weights, again.weights) == (None, None)
    assert evaluation.by != again.by


def test_a_policy_that_nobody_knows_is_named_with_those_that_there_are(run: Path) -> None:
    with pytest.raises(InvalidInput, match=r"'hover'.*sac, stay, random, circle, front"):
        evaluate_run(run, WorkerAccess(("ipc://x",), ("ipc://y",)), episodes=1, names=("hover",))


@pytest.mark.slow
def test_nothing_is_evaluated_before_there_are_weights(run: Path) -> None:
    with pytest.raises(ArtifactMissing, match=r"weights\.safetensors"):
        evaluate_run(run, WorkerAccess(("ipc://x",), ("ipc://y",)), episodes=1, names=("sac",))


@pytest.mark.slow
def test_weights_of_another_configuration_are_refused(run: Path, tmp_path: Path) -> None:
    with analytic_workers(tmp_path) as workers:
        train_run(run, workers)
    (run / "config.toml").write_text(CONFIG.replace("hidden_sizes = [16]", "hidden_sizes = [8]"))
    with pytest.raises(ArtifactDamaged):
        evaluate_run(run, workers, episodes=1, names=("sac",))


def test_workers_that_are_not_there_are_named(run: Path, tmp_path: Path) -> None:
    (run / "config.toml").write_text(CONFIG.replace("startup = 5.0", "startup = 0.3"))
    with pytest.raises(DeadlineExceeded, match="nobody"):
        train_run(run, WorkerAccess((f"ipc://{tmp_path}/nobody",), (f"ipc://{tmp_path}/nobody-either",)))
    assert not (run / "weights.safetensors").exists()


def test_a_configuration_with_an_unknown_field_is_refused(run: Path) -> None:
    (run / "config.toml").write_text("sede = 1")
    with pytest.raises(InvalidConfig, match="sede"):
        train_run(run, WorkerAccess(("ipc://x",), ("ipc://y",)))


def test_an_evaluation_tells_how_far_it_is_and_stops_on_request(tmp_path: Path) -> None:
    asked = [False]
    seconds = iter(range(100))
    clocks = Clocks(wall=lambda: 1e9, steady=lambda: float(next(seconds)))
    with Journal(tmp_path) as journal:
        progress = EvaluationProgress(journal, 40, clocks, lambda: asked[0])
        progress(4)
        progress(4)
        asked[0] = True
        with pytest.raises(EvaluationStopped):
            progress(4)
    lines = [
        msgspec.json.decode(line, type=Progress) for line in (tmp_path / "progress.jsonl").read_bytes().splitlines()
    ]
    assert [(line.phase, line.step, line.steps) for line in lines] == [("evaluation", 4, 40), ("evaluation", 8, 40)]
