"""The learner that a configuration names."""

from agent.learning.learner import Learner
from protocol.config import EnvironmentConfig
from protocol.learner_config import LearnerConfig


def make_learner(config: LearnerConfig, environment: EnvironmentConfig, *, seed: int) -> Learner:
    """A new learner for an environment, and every random generator of this process seeded. Loads torch."""
    if config.algorithm == "ppo":
        from agent.learning.ppo import PpoLearner

        return PpoLearner(config.ppo, environment, seed=seed)
    from agent.learning.sac import SacLearner

    return SacLearner(config.sac, environment, seed=seed)
