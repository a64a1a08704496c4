"""The learner that a configuration names."""

from agent.learning.learner import Learner
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidConfig
from protocol.grid_config import GridConfig
from protocol.learner_config import LearnerConfig


def make_learner(config: LearnerConfig, environment: EnvironmentConfig | GridConfig, *, seed: int) -> Learner:
    """A new learner for an environment, and every random generator of this process seeded. Loads torch.

    Raises:
        InvalidConfig: the algorithm does not learn on this environment.
    """
    if isinstance(environment, GridConfig):
        if config.algorithm != "recurrent_ppo":
            raise InvalidConfig(f"learner.algorithm: the grid is learned by recurrent_ppo, not by {config.algorithm}")
        from agent.learning.recurrent.recurrent_ppo import RecurrentPpoLearner

        return RecurrentPpoLearner(config.recurrent_ppo, environment.num_envs, seed=seed)
    if config.algorithm == "recurrent_ppo":
        raise InvalidConfig("learner.algorithm: flights are learned by sac or ppo, not by recurrent_ppo")
    if config.algorithm == "ppo":
        from agent.learning.ppo import PpoLearner

        return PpoLearner(config.ppo, environment, seed=seed)
    from agent.learning.sac import SacLearner

    return SacLearner(config.sac, environment, seed=seed)
