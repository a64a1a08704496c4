"""Small trainings with a sensor that computes what it sees."""

import itertools
from collections.abc import Callable
from pathlib import Path

from agent.checkpointing.resume import open_training
from agent.environment.vector_hover import VectorHover
from agent.learning.algorithms import make_learner
from agent.learning.learner import Learner
from agent.logbook import Clocks
from protocol.client.dispatcher import Statistics
from protocol.config import RunConfig, TrainingConfig
from protocol.environment_config import EnvironmentConfig
from protocol.failpoint import Failpoint, no_failpoint
from protocol.learner_config import LearnerConfig, PpoConfig, SacConfig
from protocol.records import Summary
from tests.agent.analytic_sensor import AnalyticSensor

CONFIG = RunConfig(
    seed=3,
    environment=EnvironmentConfig(num_envs=2, episode_steps=5),
    learner=LearnerConfig(
        sac=SacConfig(hidden_sizes=(16,), buffer_size=200, batch_size=8, updates_per_step=0.5),
        ppo=PpoConfig(hidden_sizes=(16,), n_steps=6, n_epochs=1, minibatches=2),
    ),
    training=TrainingConfig(steps=30, prefill=20, log_every=10, checkpoint_every=10),
)
CALLS = Statistics(late_replies=2, retries=1)


def trained(
    run: Path,
    config: RunConfig = CONFIG,
    *,
    sensor: AnalyticSensor | None = None,
    env: VectorHover | None = None,
    learner: Learner | None = None,
    stop: Callable[[], bool] = lambda: False,
    failpoint: Failpoint = no_failpoint,
) -> Summary:
    """Begin or go on with the training of a run directory."""
    run.mkdir(exist_ok=True)
    steady = itertools.count(0.0, 0.1)
    with open_training(
        run,
        config,
        env=env or VectorHover(sensor or AnalyticSensor(), config=config.environment),
        learner=learner or make_learner(config.learner, config.environment, seed=config.seed),
        clocks=Clocks(wall=lambda: 1e9, steady=steady.__next__),
        stop=stop,
        failpoint=failpoint,
    ) as training:
        return training.run(lambda: CALLS)
