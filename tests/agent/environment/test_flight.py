import math

import numpy as np
import pytest
from msgspec.structs import replace

from agent.environment.flight import Flight, camera_of, move, succeeded, take_off, with_estimate, with_reward
from agent.environment.reward import step_reward
from protocol.camera import project
from protocol.environment_config import CameraConfig, EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor, observe

CONFIG = EnvironmentConfig(episode_steps=3)


@pytest.fixture
def flight(sensor: AnalyticSensor) -> Flight:
    return replace(take_off(CONFIG, 5, sensor.sample(5, "train")), position=(4.0, 0.0, 2.0))


def test_a_start_follows_from_the_seed(sensor: AnalyticSensor) -> None:
    scene = sensor.sample(5, "train")
    assert take_off(CONFIG, 5, scene).position == take_off(CONFIG, 5, scene).position
    assert take_off(CONFIG, 5, scene).position != take_off(CONFIG, 6, scene).position


def test_a_start_says_nothing_about_the_yaw_of_the_same_seed(sensor: AnalyticSensor) -> None:
    scenes = [sensor.sample(seed, "train") for seed in range(300)]
    starts = [take_off(CONFIG, seed, scene).position for seed, scene in enumerate(scenes)]
    bearings = [math.atan2(y, x) for x, y, _ in starts]
    together = np.mean([math.cos(scene.yaw - bearing) for scene, bearing in zip(scenes, bearings, strict=True)])
    assert abs(together) < 0.15


def test_a_new_flight_knows_nothing_of_the_person(sensor: AnalyticSensor) -> None:
    flight = take_off(CONFIG, 5, sensor.sample(5, "train"))
    assert flight.uncertainty == 10.0
    assert np.array_equal(flight.filter.mean, np.tile([0.0, 0.0, CONFIG.target_height], (18, 1)))
    assert not flight.over


def test_moving_leaves_the_flight_before_as_it_was(flight: Flight) -> None:
    after = move(CONFIG, flight, np.array([0.0, 1.0, -0.5]))
    assert (after.position, after.steps) == ((4.0, 0.5, 1.75), 1)
    assert (flight.position, flight.steps) == ((4.0, 0.0, 2.0), 0)


def test_the_last_step_truncates(flight: Flight) -> None:
    outcomes = []
    for _ in range(3):
        flight = move(CONFIG, flight, np.zeros(3))
        outcomes.append((flight.outcome, flight.over, flight.ended_badly))
    assert outcomes == [("flying", False, False), ("flying", False, False), ("truncated", True, False)]


def test_a_crash_in_the_last_step_is_a_crash(flight: Flight) -> None:
    flight = replace(flight, position=(flight.scene.position[0] + 1.6, flight.scene.position[1], 2.0), steps=2)
    crashed = move(CONFIG, flight, np.array([-1.0, 0.0, 0.0]))
    assert (crashed.outcome, crashed.ended_badly) == ("too_close", True)


def test_an_estimate_brings_filter_and_quality(flight: Flight) -> None:
    estimate = observe(flight.scene, camera_of(CONFIG, flight), flight.filter)
    observed = with_estimate(flight, estimate)
    assert observed.filter is estimate.filter
    assert observed.quality is estimate.quality
    assert observed.uncertainty < 10.0


def test_rewards_add_up(flight: Flight) -> None:
    total = 0.0
    for number in (1, 2):
        flight, reward = with_reward(CONFIG, move(CONFIG, flight, np.zeros(3)))
        total += reward
        assert reward == step_reward(
            CONFIG, flight.scene, flight.position, flight.filter.variance, number, ended_badly=False
        )
    assert flight.total_reward == pytest.approx(total)


def test_the_camera_has_the_person_in_its_middle(flight: Flight) -> None:
    config = EnvironmentConfig(camera=CameraConfig(width=320, height=240, horizontal_fov=90.0, depth_noise="d435i"))
    camera = camera_of(config, flight)
    x, y = flight.scene.position
    assert project(np.array([[x, y, config.target_height]]), camera)[0, :2] == pytest.approx((159.5, 119.5))
    assert (camera.intrinsics.fx, camera.depth_noise) == (pytest.approx(160.0), "d435i")


@pytest.mark.parametrize(
    ("outcome", "uncertainty", "success"),
    [("truncated", 1.5, True), ("truncated", 1.6, False), ("too_close", 1.5, False), ("out_of_workspace", 0.1, False)],
)
def test_success_is_to_see_well_and_to_be_in_one_piece(outcome, uncertainty, success) -> None:
    assert succeeded(outcome, uncertainty, 1.6) is success
