"""That a training comes to something, with a sensor that computes what it sees."""

import statistics

import pytest
from msgspec.structs import replace

from agent.environment.vector_hover import VectorHover
from agent.evaluation import fly
from agent.learning.algorithms import make_learner
from agent.learning.policies import Policy, baseline, learned, scripted
from agent.training import transition_of
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import LearnerConfig, PpoConfig, SacConfig
from tests.agent.analytic_sensor import AnalyticSensor

pytestmark = pytest.mark.slow

FLIGHTS = EnvironmentConfig()
LEARNER = LearnerConfig(sac=SacConfig(hidden_sizes=(128, 128), batch_size=128), ppo=PpoConfig(hidden_sizes=(64, 64)))


def median_return(policy: Policy) -> float:
    """Of twenty flights on test scenes."""
    flights = fly(AnalyticSensor(), FLIGHTS, policy, range(1_000_000, 1_000_020), lambda steps: None)
    return statistics.median(flight.total_reward for flight in flights)


@pytest.mark.parametrize(("algorithm", "prefill", "steps"), [("sac", 1000, 4000), ("ppo", 0, 16_000)])
def test_a_trained_policy_sees_more_than_one_that_stays(algorithm, prefill, steps) -> None:
    learner = make_learner(replace(LEARNER, algorithm=algorithm), FLIGHTS, seed=0)
    script = scripted(FLIGHTS, 1.5)
    env = VectorHover(AnalyticSensor(), config=FLIGHTS)
    observations, _ = env.reset(seed=0)
    for step in range(0, prefill + steps, FLIGHTS.num_envs):
        explored = learner.act(observations, explore=True)
        actions = explored if step >= prefill else script(observations, env.flights)
        env.send(actions)
        learner.learn()
        result = env.receive()
        learner.observe(transition_of(observations, actions, result))
        observations = result[0]
    assert median_return(learned(learner)) > median_return(baseline("stay", FLIGHTS)) + 15.0
