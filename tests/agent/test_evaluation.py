import numpy as np
import pytest
from msgspec.structs import replace

from agent.environment.flight import take_off
from agent.environment.hover_task import HoverV0
from agent.evaluation import evaluate, fly, score
from agent.learning.policies import baseline
from protocol.config import EvaluationConfig, RunConfig
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor

SHORT = EnvironmentConfig(num_envs=3, episode_steps=30)


def nothing(steps: int) -> None:
    pass


def starts(sensor: AnalyticSensor, name: str, seeds: range) -> list[tuple]:
    """Seeds and positions that a policy was first asked about."""
    policy, begun = baseline(name, SHORT), []

    def noting(observations, flights):
        begun.extend((flight.seed, flight.position) for flight in flights if flight.steps == 0)
        return policy(observations, flights)

    list(fly(sensor, SHORT, noting, seeds, nothing))
    return begun


def test_every_policy_flies_the_same_scenes_from_the_same_starts(sensor: AnalyticSensor) -> None:
    staying = starts(sensor, "stay", range(100, 105))
    assert staying == starts(sensor, "front", range(100, 105))
    assert [seed for seed, _ in staying] == [100, 101, 102, 103, 104]


def test_flights_come_in_the_seeds_order_however_many_fly_at_once(sensor: AnalyticSensor) -> None:
    policy = baseline("random", SHORT)
    alone = list(fly(sensor, replace(SHORT, num_envs=1), policy, range(7), nothing))
    together = list(fly(sensor, SHORT, policy, range(7), nothing))
    assert [flight.seed for flight in together] == list(range(7))
    for one, other in zip(alone, together, strict=True):
        assert (one.position, one.steps, one.outcome) == (other.position, other.steps, other.outcome)
        assert one.total_reward == other.total_reward
        assert np.array_equal(one.quality, other.quality)


def test_people_are_those_of_the_test_split(sensor: AnalyticSensor) -> None:
    flights = fly(sensor, SHORT, baseline("stay", SHORT), range(8), nothing)
    assert all(flight.scene.identity >= 40 for flight in flights)


def test_a_score_worked_by_hand(sensor: AnalyticSensor) -> None:
    start = take_off(SHORT, 0, sensor.sample(0, "test"))
    good, poor = np.full(18, 0.9), np.full(18, 0.5)
    flights = [
        replace(start, total_reward=-10.0, steps=30, outcome="truncated", quality=good),
        replace(start, total_reward=-20.0, steps=30, outcome="truncated", quality=poor),
        replace(start, total_reward=-210.0, steps=6, outcome="too_close", quality=good),
        replace(start, total_reward=-220.0, steps=6, outcome="out_of_workspace", quality=poor),
    ]
    table = score("hand", flights, HoverV0(EnvironmentConfig(success_threshold=1.6)))
    assert (table.policy, table.episodes) == ("hand", 4)
    assert table.total_reward.mean == pytest.approx(-115.0)
    assert table.uncertainty.mean == pytest.approx((1.0 + 5.0 + 1.0 + 5.0) / 4)
    assert table.success.mean == 0.25
    assert table.crash.mean == 0.5
    assert table.length.mean == 18.0
    assert table.success.low < 0.25 < table.success.high


def test_an_evaluation_has_a_score_for_each_policy_in_its_order(sensor: AnalyticSensor) -> None:
    config = RunConfig(environment=SHORT, evaluation=EvaluationConfig(first_seed=500))
    policies = {name: baseline(name, SHORT) for name in ("front", "stay")}
    steps: list[int] = []
    evaluation = evaluate(sensor, config, policies, 4, steps.append)
    assert [row.policy for row in evaluation.scores] == ["front", "stay"]
    assert (evaluation.first_seed, evaluation.success_threshold) == (500, SHORT.success_threshold)
    assert evaluation.scores[0].uncertainty.mean < evaluation.scores[1].uncertainty.mean
    assert sum(steps) == 2 * 4 * SHORT.episode_steps


def test_an_evaluation_ends_where_it_is_told_to(sensor: AnalyticSensor) -> None:
    class Enough(Exception):
        pass

    def stop(steps: int) -> None:
        raise Enough

    with pytest.raises(Enough):
        evaluate(sensor, RunConfig(environment=SHORT), {"stay": baseline("stay", SHORT)}, 4, stop)
    assert sensor.requests == 6
