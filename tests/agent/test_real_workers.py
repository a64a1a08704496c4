"""The agent with the render and perception workers of a run: real pictures, a real network, real processes."""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import gymnasium
import msgspec
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import agent  # noqa: F401 (registers the environment)
from agent.checkpointing.weights import load_weights
from agent.connections import WorkerAccess
from agent.environment.sensor import RemoteSensor
from protocol import Pool, Timeouts
from protocol.messages import Role
from protocol.records import Evaluation, Summary
from tests.agent.serving import agent_command, environment, real_workers

pytestmark = pytest.mark.slow

PATIENCE = Timeouts(startup=120.0)

CONFIG = """
[environment]
num_envs = 4
episode_steps = 10
[learner.sac]
hidden_sizes = [32, 32]
batch_size = 16
[training]
steps = 40
prefill = 16
[evaluation]
episodes = 2
baselines = ["stay"]
"""


@pytest.fixture(scope="module")
def workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorkerAccess]:
    with real_workers(tmp_path_factory.mktemp("workers")) as addresses:
        yield addresses


@pytest.fixture
def sensor(workers: WorkerAccess) -> Iterator[RemoteSensor]:
    with (
        Pool(workers.render, role=Role.AGENT, serves=Role.RENDER, timeouts=PATIENCE) as render,
        Pool(workers.perception, role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as perception,
    ):
        render.wait_ready()
        perception.wait_ready()
        yield RemoteSensor(render, perception)


def test_gymnasium_finds_nothing_to_complain_about(sensor: RemoteSensor) -> None:
    check_env(gymnasium.make("vantage/Hover-v0", sensor=sensor).unwrapped)


def test_every_stage_of_a_step_is_timed(sensor: RemoteSensor) -> None:
    env = gymnasium.make("vantage/Hover-v0", sensor=sensor)
    env.reset(seed=0)
    *_, info = env.step(np.zeros(3, np.float32))
    assert set(info["timings"]) == {"render", "infer", "decode", "lift", "qoe", "filter", "transport"}
    assert all(seconds >= 0.0 for seconds in info["timings"].values())


def test_a_run_trains_evaluates_and_trains_the_same_again(workers: WorkerAccess, tmp_path: Path) -> None:
    for name in ("run", "again"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.toml").write_text(CONFIG)
        subprocess.run(agent_command("train", tmp_path / name, workers), env=environment(), check=True)
    summary = msgspec.json.decode((tmp_path / "run" / "summary.json").read_bytes(), type=Summary)
    assert (summary.steps, summary.retries) == (40, 0)
    weights, again = [load_weights(tmp_path / name / "weights.safetensors")[0] for name in ("run", "again")]
    assert all(np.array_equal(weights[name], again[name]) for name in weights)

    subprocess.run(agent_command("evaluate", tmp_path / "run", workers), env=environment(), check=True)
    evaluation = msgspec.json.decode((tmp_path / "run" / "evaluation.json").read_bytes(), type=Evaluation)
    assert [(score.policy, score.episodes) for score in evaluation.scores] == [("sac", 2), ("stay", 2)]
