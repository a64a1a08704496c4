"""Every part of a checkpoint is needed: with any one of them left out, the comparison of two trainings sees it.

A part that is left out has the value that a new process gives it. The checkpoint is of a step under way, whose pictures
did not come, so that it has all parts that there can be.
"""

import itertools
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from agent.checkpointing.append_only_file import mark_of_bytes
from agent.checkpointing.checkpoint import Content, read_checkpoint, write_files, write_manifest
from agent.environment.vector_hover import VectorHover
from agent.flight_log import FlightLog
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner
from protocol.config import RunConfig, TrainingConfig
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput, WorkerLost
from protocol.learner_config import LearnerConfig, PpoConfig, SacConfig
from tests.agent.analytic_sensor import TIMING, AnalyticSensor
from tests.agent.checkpointing.comparison import differing
from tests.agent.checkpointing.restless import restless
from tests.agent.trainings import trained

pytestmark = pytest.mark.slow

SAC = RunConfig(
    seed=3,
    environment=EnvironmentConfig(num_envs=2, episode_steps=5),
    learner=LearnerConfig(sac=SacConfig(hidden_sizes=(16,), buffer_size=40, batch_size=8, updates_per_step=0.5)),
    training=TrainingConfig(steps=60, prefill=20, log_every=12, checkpoint_every=1000),
)
PPO = replace(
    SAC, learner=LearnerConfig(algorithm="ppo", ppo=PpoConfig(hidden_sizes=(16,), n_steps=6, n_epochs=1, minibatches=2))
)
CONFIGS = {"sac": SAC, "ppo": PPO}
LOST_AT = {"sac": 75, "ppo": 53}
"""The picture that does not come: after the replay memory has begun anew, or within a rollout."""

ALL = (
    "loop.phase",
    "loop.done",
    "loop.under_way",
    "environment.run_seed",
    "environment.begun",
    "environment.flights",
    "environment.generators.environment",
    "environment.generators.actions",
    "environment.generators.single_actions",
    "logbook.flights.count",
    "logbook.flights.recent",
    "logbook.flown",
    "logbook.gathered",
    "learner.memory_index",
    "learner.observed",
    "learner.updates",
    "learner.random.python",
    "learner.random.numpy",
    "learner.random.torch",
)
PARTS = {
    "sac": (
        *ALL,
        "learner.memory_filled",
        "learner.optimizers.policy_optimizer",
        "learner.optimizers.critic_optimizer",
        "learner.optimizers.entropy_optimizer",
        "learner.log_entropy_coefficient",
    ),
    "ppo": (
        *ALL,
        "learner.learned",
        "learner.rollout",
        "learner.optimizers.optimizer",
        "learner.under_way._current_log_prob",
        "learner.under_way._current_values",
    ),
}
NETWORKS = {
    "sac": ("policy", "critic_1", "critic_2", "target_critic_1", "target_critic_2"),
    "ppo": ("policy", "value"),
}
OF_A_WHOLE_ROLLOUT = ("learner.memory_filled", "learner.under_way._current_next_observations")
"""What matters to PPO only while its first rollout is whole and not yet learned from."""


def each(parts: dict[str, tuple[str, ...]]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("name", "part"), [(name, part) for name in CONFIGS for part in parts[name]])


def flown(run: Path, name: str, **changes: Any) -> None:
    config = CONFIGS[name]
    env = VectorHover(changes.pop("sensor", None) or AnalyticSensor(), config=config.environment)
    wrap = changes.pop("wrap", lambda learner: learner)
    trained(run, config, env=env, learner=wrap(restless(config, env)), **changes)


@pytest.fixture(scope="module")
def control_run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    return each_once(tmp_path_factory, lambda run, name: flown(run, name))


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """A training whose workers were lost in the middle of a step."""

    def fly(run: Path, name: str) -> None:
        looks = itertools.count(1)

        def deliver(pending, observation) -> None:
            if next(looks) == LOST_AT[name]:
                pending.fail(WorkerLost("gone"), TIMING)
            else:
                pending.succeed(observation, TIMING)

        with pytest.raises(WorkerLost):
            flown(run, name, sensor=AnalyticSensor(deliver))

    return each_once(tmp_path_factory, fly)


def each_once(factory: pytest.TempPathFactory, fly: Callable[[Path, str], None]) -> Callable[[str], Path]:
    runs: dict[str, Path] = {}

    def run_of(name: str) -> Path:
        if name not in runs:
            runs[name] = factory.mktemp(name) / "run"
            fly(runs[name], name)
        return runs[name]

    return run_of


def newest(run: Path) -> Path:
    return max((run / "checkpoints").glob("step-*"))


def rewritten(run: Path, change: Callable[[dict[str, Any], dict[str, Any]], None]) -> None:
    """Write a run's newest checkpoint anew, with its state and its weights changed."""
    checkpoint = read_checkpoint(newest(run))
    state, weights, manifest = checkpoint.state(), checkpoint.weights(), checkpoint.manifest
    change(state, weights)
    content = Content(
        step=manifest.step,
        mean_return=None,
        weights=weights,
        about={},
        state=state,
        measured=checkpoint.measured(),
    )
    write_manifest(checkpoint.path, replace(manifest, files=write_files(checkpoint.path, content)))


def of_a_new_process(config: RunConfig) -> dict[str, Any]:
    """The state that a training has before anything was flown."""
    learner = make_learner(config.learner, config.environment, seed=config.seed)
    return {
        "loop": {"phase": "prefill" if learner.off_policy else "evaluation", "done": 0, "under_way": None},
        "environment": VectorHover(AnalyticSensor(), config=config.environment).state(),
        "logbook": {"flights": FlightLog(1.6).state(), "flown": 0, "gathered": {}},
        "learner": learner.state(),
    }


def gone_on(run: Path, name: str, **changes: Any) -> str:
    """Go on with a training; what is wrong with it may be so wrong that it can't."""
    try:
        flown(run, name, **changes)
    except (ValueError, IndexError, TypeError, InvalidInput) as error:
        return type(error).__name__
    return "done"


def leaves(state: dict[str, Any], prefix: str = "") -> Iterator[str]:
    """The ways to all parts of a state, as deep as `PARTS` go."""
    for key, value in state.items():
        path = f"{prefix}{key}"
        known = any(part.startswith(f"{path}.") for parts in PARTS.values() for part in parts)
        yield from leaves(value, f"{path}.") if known else [path]


@pytest.mark.parametrize("name", CONFIGS)
def test_with_all_parts_nothing_differs(tmp_path, control_run, interrupted, name: str) -> None:
    run = tmp_path / "run"
    shutil.copytree(interrupted(name), run)
    rewritten(run, lambda state, weights: None)
    assert gone_on(run, name) == "done"
    assert differing(run, control_run(name)) == set()


@pytest.mark.parametrize("name", CONFIGS)
def test_these_are_all_parts(interrupted, name: str) -> None:
    state = read_checkpoint(newest(interrupted(name))).state()
    assert set(leaves(state)) == set(PARTS[name]) | (set(OF_A_WHOLE_ROLLOUT) if name == "ppo" else set())
    assert state["loop"]["under_way"]["learned"] is not None
    assert (state["loop"]["under_way"]["ahead"] is not None) == (name == "sac"), "on policy, nothing is chosen ahead"
    networks = {one.partition(".")[0] for one in read_checkpoint(newest(interrupted(name))).weights()}
    assert networks == set(NETWORKS[name])


@each(PARTS)
def test_a_part_of_the_state_that_is_left_out_is_seen(tmp_path, control_run, interrupted, name: str, part: str) -> None:
    run = tmp_path / "run"
    shutil.copytree(interrupted(name), run)
    rewritten(run, without(part, name))
    assert gone_on(run, name) != "done" or differing(run, control_run(name))


def without(part: str, name: str) -> Callable[[dict[str, Any], dict[str, Any]], None]:
    def leave_out(state: dict[str, Any], weights: dict[str, Any]) -> None:
        fresh, (*way, last) = of_a_new_process(CONFIGS[name]), part.split(".")
        for key in way:
            state, fresh = state[key], fresh[key]
        state[last] = fresh[last]

    return leave_out


@pytest.mark.parametrize("part", OF_A_WHOLE_ROLLOUT)
def test_a_part_of_a_whole_rollout_that_is_left_out_is_seen(tmp_path, control_run, part: str) -> None:
    run, steps = tmp_path / "run", iter(range(PPO.learner.ppo.n_steps))
    flown(run, "ppo", stop=lambda: next(steps, None) is None)
    rewritten(run, without(part, "ppo"))
    assert gone_on(run, "ppo") != "done" or differing(run, control_run("ppo"))


@each(NETWORKS)
def test_a_network_that_is_left_out_is_seen(tmp_path, control_run, interrupted, name: str, part: str) -> None:
    def leave_out(state: dict[str, Any], weights: dict[str, Any]) -> None:
        config = CONFIGS[name]
        fresh = make_learner(config.learner, config.environment, seed=config.seed).weights()
        weights |= {key: array for key, array in fresh.items() if key.startswith(f"{part}.")}

    run = tmp_path / "run"
    shutil.copytree(interrupted(name), run)
    rewritten(run, leave_out)
    assert gone_on(run, name) == "done"
    assert "weights.safetensors" in differing(run, control_run(name))


def test_a_replay_memory_that_is_not_recalled_is_seen(tmp_path, control_run, interrupted) -> None:
    def forgetful(learner: Learner) -> Learner:
        learner.recall = lambda steps: None
        return learner

    run = tmp_path / "run"
    shutil.copytree(interrupted("sac"), run)
    assert gone_on(run, "sac", wrap=forgetful) == "InvalidInput", "unwritten places are NaN, and so are velocities"


@pytest.mark.parametrize("part", ["replay", "episodes"])
def test_a_journal_that_is_not_named_is_seen(tmp_path, control_run, interrupted, part: str) -> None:
    run = tmp_path / "run"
    shutil.copytree(interrupted("sac"), run)
    checkpoint = read_checkpoint(newest(run))
    grown = checkpoint.manifest.grown
    changed = replace(grown, replay=()) if part == "replay" else replace(grown, episodes=mark_of_bytes(b""))
    write_manifest(checkpoint.path, replace(checkpoint.manifest, grown=changed))
    gone_on(run, "sac")
    assert {"replay": "replay/000000.bin", "episodes": "episodes.jsonl"}[part] in differing(run, control_run("sac"))
