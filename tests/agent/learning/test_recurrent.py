"""That a learner of another kind fits a checkpoint: only what `Learner` says is asked of it."""

import pytest

from agent.learning.learner import Learner
from protocol.config import RunConfig, TrainingConfig
from protocol.environment_config import EnvironmentConfig
from tests.agent.checkpointing.comparison import differing
from tests.agent.learning.gru_learner import RecurrentLearner
from tests.agent.trainings import trained

CONFIG = RunConfig(
    seed=3,
    environment=EnvironmentConfig(num_envs=2, episode_steps=7),
    training=TrainingConfig(steps=50, log_every=12, checkpoint_every=14),
)


def learner() -> Learner:
    return RecurrentLearner(CONFIG.environment.num_envs)


@pytest.mark.parametrize("steps", [3, 5, 8, 14, 22])
def test_a_recurrent_learner_stopped_within_a_flight_and_a_rollout_goes_on_to_the_bit(tmp_path, steps: int) -> None:
    trained(tmp_path / "control_run", CONFIG, learner=learner())
    left = iter(range(steps))
    stopped = trained(tmp_path / "run", CONFIG, learner=learner(), stop=lambda: next(left, None) is None)
    assert not stopped.complete
    assert trained(tmp_path / "run", CONFIG, learner=learner()).complete
    assert differing(tmp_path / "run", tmp_path / "control_run") == set()
    assert not (tmp_path / "run" / "replay").exists()


@pytest.mark.parametrize("part", ["_hidden", "_first", "_steps"])
def test_a_hidden_state_or_a_rollout_that_is_not_kept_is_seen(tmp_path, part: str) -> None:
    class Forgetful(RecurrentLearner):
        def restore(self, state) -> None:
            fresh = getattr(self, part)
            super().restore(state)
            setattr(self, part, fresh)

    trained(tmp_path / "control_run", CONFIG, learner=learner())
    left = iter(range(8))
    trained(tmp_path / "run", CONFIG, learner=learner(), stop=lambda: next(left, None) is None)
    trained(tmp_path / "run", CONFIG, learner=Forgetful(CONFIG.environment.num_envs))
    assert "weights.safetensors" in differing(tmp_path / "run", tmp_path / "control_run")
