import numpy as np
import pytest

from agent.learning.algorithms import make_learner
from agent.learning.learner import learned_rewards
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidConfig
from protocol.grid_config import GridConfig
from protocol.learner_config import LearnerConfig, PpoConfig, RecurrentPpoConfig, SacConfig


@pytest.mark.parametrize(("algorithm", "off_policy"), [("sac", True), ("ppo", False)])
def test_one_word_of_the_configuration_chooses_the_learner(algorithm, off_policy) -> None:
    sizes = {"sac": SacConfig(hidden_sizes=(8,), batch_size=4), "ppo": PpoConfig(hidden_sizes=(8,))}
    learner = make_learner(LearnerConfig(algorithm=algorithm, **sizes), EnvironmentConfig(num_envs=2), seed=0)
    assert learner.off_policy is off_policy
    assert learner.act(np.zeros((2, 111), np.float32), explore=False).shape == (2, 3)


def test_the_grid_has_a_learner_of_its_own() -> None:
    small = RecurrentPpoConfig(lstm_hidden_size=8, hidden_size=8, minibatches=2)
    learner = make_learner(LearnerConfig("recurrent_ppo", recurrent_ppo=small), GridConfig(num_envs=2), seed=0)
    assert learner.off_policy is False
    assert learner.act(np.zeros((2, 20), np.float32), explore=False).shape == (2,)


@pytest.mark.parametrize(
    ("algorithm", "environment"), [("sac", GridConfig()), ("ppo", GridConfig()), ("recurrent_ppo", EnvironmentConfig())]
)
def test_a_learner_of_another_environment_is_refused(algorithm, environment) -> None:
    with pytest.raises(InvalidConfig, match=algorithm):
        make_learner(LearnerConfig(algorithm), environment, seed=0)


def test_rewards_are_cut_at_the_floor_before_they_are_scaled() -> None:
    learned = learned_rewards(np.array([-0.5, -30.0, -100.7]), floor=-30.0, scale=10.0)
    assert learned.tolist() == [-5.0, -300.0, -300.0]
    assert learned.dtype == np.float32
