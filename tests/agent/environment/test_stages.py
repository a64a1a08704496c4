import numpy as np
import pytest

from agent.environment.flight import camera_of, take_off
from agent.environment.stages import StageMedians, StageTimes, times_of
from protocol.client.pending import Timing
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor


def test_transport_is_that_of_both_hops() -> None:
    sensor = AnalyticSensor(
        deliver=lambda pending, seen: pending.succeed(seen, Timing(wall=0.1, queue=0.02, compute=0.075))
    )
    flight = take_off(EnvironmentConfig(), 0, sensor.sample(0, "train"))
    times = times_of(sensor.observe(flight.scene, camera_of(EnvironmentConfig(), flight), flight.filter))
    # Of the wall's 0.1 s, 0.005 s are between us and the perception worker, and it spent 0.001 s on its way to render.
    assert times["transport"] == pytest.approx(0.006)
    assert (times["render"], times["infer"]) == (0.02, 0.03)


def test_packing_on_the_way_is_a_part_of_transport() -> None:
    sensor = AnalyticSensor(deliver=lambda pending, seen: pending.succeed(seen, Timing(wall=0.1, compute=0.1)))
    flight = take_off(EnvironmentConfig(), 0, sensor.sample(0, "train"))
    estimate = sensor.observe(flight.scene, camera_of(EnvironmentConfig(), flight), flight.filter)
    estimate.result().timings.update(transport=0.001, pack=0.004, unpack=0.003)
    assert times_of(estimate)["transport"] == pytest.approx(0.008)


def test_stages_that_the_records_do_not_know_are_left_out() -> None:
    sensor = AnalyticSensor()
    flight = take_off(EnvironmentConfig(), 0, sensor.sample(0, "train"))
    estimate = sensor.observe(flight.scene, camera_of(EnvironmentConfig(), flight), flight.filter)
    estimate.result().timings["daydream"] = 1.0
    assert "daydream" not in times_of(estimate)


def test_the_same_step_is_the_same_however_long_it_took() -> None:
    assert StageTimes({"render": 0.1}) == StageTimes({"render": 0.2})
    assert StageTimes({}) != {}


def test_medians_are_over_the_last_steps() -> None:
    medians = StageMedians(window=3)
    for seconds in (9.0, 9.0, 1.0, 2.0, 30.0):
        medians.add({"render": seconds})
    medians.add({"infer": float(np.nan)})
    assert medians.medians() == {"render": 2.0}
