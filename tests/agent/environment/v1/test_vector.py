"""Several drones of version 1 at once: flights that end in a success, and those that follow."""

import numpy as np
import pytest

from agent.environment.vector_hover import VectorHover
from protocol.environment_config import HoverConfig
from tests.agent.analytic_sensor import AnalyticSensor

EASY = HoverConfig(num_envs=4, episode_steps=12, wrist_radius=1.5, body_radius=1.5, certain_pictures=2)
"""Thresholds that the tests' sensor reaches from most places."""


def actions(step: int) -> np.ndarray:
    return np.random.default_rng(step).uniform(-1, 1, (EASY.num_envs, 3))


def test_a_flight_that_succeeds_terminates_and_the_next_one_follows(sensor: AnalyticSensor) -> None:
    env, ended = VectorHover(sensor, config=EASY), 0
    env.reset(seed=3)
    for step in range(20):
        before = [flight.seed for flight in env.flights]
        _, rewards, terminated, truncated, infos = env.step(actions(step))
        for drone in np.flatnonzero(terminated | truncated):
            final = {name: values[drone] for name, values in infos["final_info"].items()}
            if final["outcome"] == "succeeded":
                ended += 1
                assert (terminated[drone], truncated[drone], rewards[drone]) == (True, False, 0.0)
            assert final["seed"] == before[drone] != env.flights[drone].seed
            assert env.flights[drone].steps == 0
    assert ended > 5


def test_each_episode_begins_once_and_in_order(sensor: AnalyticSensor) -> None:
    env, begun = VectorHover(sensor, config=EASY), []
    env.reset(seed=3)
    begun += [flight.seed for flight in env.flights]
    for step in range(30):
        env.step(actions(step))
        begun += [flight.seed for flight in env.flights if flight.steps == 0]
    fresh = VectorHover(sensor, num_envs=len(begun), config=EASY)
    fresh.reset(seed=3)
    assert begun == [flight.seed for flight in fresh.flights]


@pytest.mark.parametrize("stop", [1, 9])
def test_it_goes_on_from_a_state_as_if_never_stopped(sensor: AnalyticSensor, stop: int) -> None:
    env, other = VectorHover(sensor, config=EASY), VectorHover(sensor, config=EASY)
    env.reset(seed=3)
    for step in range(stop):
        env.step(actions(step))
    other.restore(env.state())
    for step in range(stop, stop + 12):
        one, two = env.step(actions(step)), other.step(actions(step))
        for mine, theirs in zip(one[:4], two[:4], strict=True):
            assert np.array_equal(mine, theirs)
