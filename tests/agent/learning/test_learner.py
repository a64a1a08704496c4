import numpy as np
import pytest

from agent.learning.algorithms import make_learner
from agent.learning.learner import learned_rewards
from protocol.config import EnvironmentConfig
from protocol.learner_config import LearnerConfig, PpoConfig, SacConfig


@pytest.mark.parametrize(("algorithm", "off_policy"), [("sac", True), ("ppo", False)])
def test_one_word_of_the_configuration_chooses_the_learner(algorithm, off_policy) -> None:
    sizes = {"sac": SacConfig(hidden_sizes=(8,), batch_size=4), "ppo": PpoConfig(hidden_sizes=(8,))}
    learner = make_learner(LearnerConfig(algorithm=algorithm, **sizes), EnvironmentConfig(num_envs=2), seed=0)
    assert learner.off_policy is off_policy
    assert learner.act(np.zeros((2, 111), np.float32), explore=False).shape == (2, 3)


def test_rewards_are_cut_at_the_floor_before_they_are_scaled() -> None:
    learned = learned_rewards(np.array([-0.5, -30.0, -100.7]), floor=-30.0, scale=10.0)
    assert learned.tolist() == [-5.0, -300.0, -300.0]
    assert learned.dtype == np.float32
