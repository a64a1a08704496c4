import pytest
from msgspec.structs import replace

from agent.checkpointing.resume_fingerprint import fingerprint, require_same
from agent.errors import OtherConfig
from protocol.config import (
    EvaluationConfig,
    PerceptionConfig,
    RenderConfig,
    RunConfig,
    SupervisionConfig,
    TimeoutsConfig,
    TrainingConfig,
)
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import LearnerConfig, SacConfig

CONFIG = RunConfig()


@pytest.mark.parametrize(
    "other",
    [
        replace(CONFIG, timeouts=TimeoutsConfig(call=9.0)),
        replace(CONFIG, supervision=SupervisionConfig(max_restarts=9)),
        replace(CONFIG, evaluation=EvaluationConfig(episodes=9)),
        replace(CONFIG, render=RenderConfig(workers=9)),
        replace(CONFIG, perception=PerceptionConfig(workers=9, prefetch=9)),
        replace(CONFIG, training=TrainingConfig(steps=9, log_every=9, checkpoint_every=9, keep_checkpoints=9)),
    ],
)
def test_what_a_result_does_not_depend_on_may_change(other: RunConfig) -> None:
    require_same(fingerprint(CONFIG), other, "it")


@pytest.mark.parametrize(
    ("other", "words"),
    [
        (replace(CONFIG, seed=1), "seed was 0, is 1"),
        (replace(CONFIG, environment=EnvironmentConfig(num_envs=2)), r"environment\.num_envs was 4, is 2"),
        (replace(CONFIG, learner=LearnerConfig(algorithm="ppo")), r"learner\.algorithm was 'sac', is 'ppo'"),
        (replace(CONFIG, learner=LearnerConfig(sac=SacConfig(hidden_sizes=(8,)))), r"learner\.sac\.hidden"),
        (replace(CONFIG, training=TrainingConfig(prefill=9)), r"training\.prefill was 1000, is 9"),
        (replace(CONFIG, perception=PerceptionConfig(network="n.onnx")), r"perception\.network"),
    ],
)
def test_what_differs_is_named(other: RunConfig, words: str) -> None:
    with pytest.raises(OtherConfig, match=f"it is of another configuration: .*{words}"):
        require_same(fingerprint(CONFIG), other, "it")


def test_a_setting_that_came_later_had_its_default() -> None:
    recorded = fingerprint(CONFIG)
    del recorded["environment"]["beta"]
    require_same(recorded, CONFIG, "it")
    with pytest.raises(OtherConfig, match=r"environment\.beta was 2\.0, is 3\.0"):
        require_same(recorded, replace(CONFIG, environment=EnvironmentConfig(beta=3.0)), "it")


def test_a_setting_that_nobody_knows_is_named() -> None:
    with pytest.raises(OtherConfig, match="wind"):
        require_same({**fingerprint(CONFIG), "wind": 3}, CONFIG, "it")
