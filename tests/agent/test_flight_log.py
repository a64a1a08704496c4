import numpy as np
import pytest

from agent.environment.vector_hover import VectorHover
from agent.flight_log import RECENT, SCRIPTED, FlightLog
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor


def test_finished_flights_are_numbered_as_they_end(sensor: AnalyticSensor) -> None:
    env, log = VectorHover(sensor, config=EnvironmentConfig(num_envs=3, episode_steps=2)), FlightLog(1.6)
    env.reset(seed=0)
    begun = env.flights
    assert log.add(env.step(np.zeros((3, 3)))[-1], "sac") == []
    total = [flight.total_reward for flight in env.flights]
    _, rewards, *_, infos = env.step(np.zeros((3, 3)))
    episodes = log.add(infos, "sac")
    assert [episode.number for episode in episodes] == [0, 1, 2]
    assert [episode.seed for episode in episodes] == [flight.seed for flight in begun]
    assert [episode.total_reward for episode in episodes] == pytest.approx(total + rewards)
    assert {(episode.policy, episode.length, episode.outcome) for episode in episodes} == {("sac", 2, "truncated")}
    env.step(np.zeros((3, 3)))
    assert [episode.number for episode in log.add(env.step(np.zeros((3, 3)))[-1], "sac")] == [3, 4, 5]
    assert log.count == 6


def finals(*flights: tuple[float, float, str]) -> dict:
    """The infos of a step that ended these flights: return, uncertainty and outcome."""
    return {
        "_final_info": np.ones(len(flights), bool),
        "final_info": {
            "total_reward": np.array([one for one, _, _ in flights]),
            "uncertainty": np.array([one for _, one, _ in flights]),
            "outcome": np.array([one for _, _, one in flights], object),
            "seed": np.zeros(len(flights), int),
            "length": np.ones(len(flights), int),
        },
    }


def test_means_are_over_the_last_flights() -> None:
    log = FlightLog(1.6)
    assert (log.mean_return, log.mean_uncertainty) == (None, None)
    log.add(finals((-100.0, 9.0, "truncated")), "sac")
    assert (log.mean_return, log.mean_uncertainty) == (-100.0, 9.0)
    log.add(finals(*[(-10.0, 2.0, "truncated")] * RECENT), "sac")
    assert (log.mean_return, log.mean_uncertainty) == (-10.0, 2.0)


def test_the_learners_return_is_told_once_all_of_the_last_flights_are_its_own() -> None:
    log = FlightLog(1.6)
    log.add(finals((-5.0, 1.0, "truncated")), SCRIPTED)
    for _ in range(RECENT - 1):
        log.add(finals((-10.0, 2.0, "truncated")), "sac")
        assert log.learners_return is None
    log.add(finals((-10.0, 2.0, "truncated")), "sac")
    assert log.learners_return == -10.0


def test_a_log_restored_goes_on_counting() -> None:
    log, other = FlightLog(1.6), FlightLog(1.6)
    log.add(finals(*[(-10.0, 2.0, "truncated")] * 3), "sac")
    other.restore(log.state())
    for one in (log, other):
        one.add(finals((-20.0, 4.0, "too_close")), "sac")
    assert (other.count, other.mean_return, other.mean_uncertainty) == (4, -12.5, 2.5)
    assert other.state() == log.state()


def test_success_is_marked() -> None:
    ends = finals((0.0, 1.5, "truncated"), (0.0, 1.7, "truncated"), (0.0, 1.0, "too_close"))
    assert [episode.success for episode in FlightLog(1.6).add(ends, "sac")] == [True, False, False]
