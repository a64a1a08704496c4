"""The rules of version 1, with a sensor that computes what it sees."""

import math

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from msgspec.structs import replace

import agent  # noqa: F401 (registers the environments)
from agent.environment.flight import Flight, camera_of
from agent.environment.reward import front_point
from agent.environment.v1.observation import AGES, JOINTS, POSITION, RADII, SHARES, VELOCITY, observation_space
from agent.environment.v1.posterior import expected_errors, over_upper_body, radii
from agent.environment.v1.task import HoverV1
from protocol.environment_config import HoverConfig
from protocol.pose_estimate import FilterState
from protocol.skeleton import Joint
from tests.agent.analytic_sensor import AnalyticSensor, joints_of, observe

CONFIG = HoverConfig(episode_steps=10, certain_pictures=2, wrist_radius=0.08, body_radius=0.06, error_scale=5.0)
TASK = HoverV1(CONFIG)


@pytest.fixture
def flight(sensor: AnalyticSensor) -> Flight:
    return TASK.take_off(5, sensor.sample(5, "train"))


def knowing(flight: Flight, deviation: float) -> Flight:
    """The flight with a filter that knows every joint, as uncertain along each axis."""
    known = FilterState(
        mean=joints_of(flight.scene),
        variance=np.full((18, 3), deviation**2),
        process_noise=np.zeros(18),
        seen=np.ones(18, bool),
        rule="variance",
    )
    return replace(flight, filter=known)


def pictured(flight: Flight, deviation: float) -> Flight:
    """The flight after a picture that leaves its filter as uncertain."""
    estimate = observe(flight.scene, camera_of(CONFIG, flight), flight.filter)
    return TASK.with_estimate(flight, replace(estimate, filter=knowing(flight, deviation).filter))


def test_its_filter_believes_the_lifters_variances(flight: Flight) -> None:
    assert flight.filter.rule == "variance"


def test_an_observation_has_its_numbers_where_the_table_says(flight: Flight) -> None:
    flight = replace(
        knowing(flight, 0.01),
        position=(4.0, -1.0, 2.0),
        velocity=(0.5, -0.25, 0.0),
        unseen=np.arange(18.0),
        steps=4,
        certain_pictures=1,
    )
    seen = TASK.observation(flight)
    assert observation_space().contains(seen)
    joints = seen[JOINTS].reshape(18, 3) + flight.position
    np.testing.assert_allclose(joints, joints_of(flight.scene), atol=1e-5)
    assert seen[RADII] == pytest.approx(np.full(18, 0.025), rel=0.01)
    assert seen[AGES] == pytest.approx(np.minimum(np.arange(18) / 10, 1.0))
    assert (seen[POSITION].tolist(), seen[VELOCITY].tolist()) == ([4.0, -1.0, 2.0], [0.5, -0.25, 0.0])
    assert seen[SHARES] == pytest.approx([0.4, 0.5])


def test_a_wild_filters_observation_is_cut_to_the_space(flight: Flight) -> None:
    wild = replace(flight.filter, mean=np.full((18, 3), 900.0), variance=np.full((18, 3), 1e5))
    assert observation_space().contains(TASK.observation(replace(flight, filter=wild)))


def test_a_move_tells_the_velocity_that_was_flown(flight: Flight) -> None:
    moved = TASK.move(flight, np.array([0.5, -3.0, 0.0]))
    assert moved.velocity == pytest.approx((0.5, -1.0, 0.0))


def test_a_joint_ages_until_it_is_detected(flight: Flight) -> None:
    estimate = observe(flight.scene, camera_of(CONFIG, flight), flight.filter)
    keypoints = np.full((18, 2), 7.0)
    keypoints[Joint.NOSE] = np.nan
    aged = TASK.with_estimate(replace(flight, unseen=np.full(18, 3.0)), replace(estimate, keypoints=keypoints))
    assert aged.unseen.tolist() == [4.0] + [0.0] * 17


def test_certain_pictures_in_a_row_end_a_flight_with_the_next_step(flight: Flight) -> None:
    for certain in (1, 2):
        flight = pictured(flight, 0.01)
        assert (flight.certain_pictures, flight.over) == (certain, False)
    ended = TASK.move(flight, np.ones(3))
    assert (ended.outcome, ended.terminated, ended.takes_picture, ended.ended_badly) == (
        "succeeded",
        True,
        False,
        False,
    )
    assert (ended.steps, ended.position) == (flight.steps + 1, flight.position)
    assert TASK.succeeded(ended)
    assert TASK.with_reward(ended)[1] == 0.0


def test_an_uncertain_picture_begins_the_row_anew(flight: Flight) -> None:
    flight = pictured(pictured(flight, 0.01), 0.05)
    assert flight.certain_pictures == 0
    assert TASK.move(flight, np.zeros(3)).outcome == "flying"


@pytest.mark.parametrize(("joint", "certain"), [(Joint.LEFT_WRIST, False), (Joint.LEFT_KNEE, True)])
def test_the_wrist_that_is_nearer_must_be_certain_of_hands_that_hang(
    flight: Flight, joint: Joint, certain: bool
) -> None:
    known = knowing(flight, 0.01)
    towards = joints_of(flight.scene)[Joint.LEFT_WRIST] - joints_of(flight.scene)[Joint.RIGHT_WRIST]
    x, y, z = (joints_of(flight.scene)[Joint.LEFT_WRIST] + 5.0 * towards).tolist()
    variance = known.filter.variance.copy()
    variance[joint] = 0.05**2
    known = replace(known, filter=replace(known.filter, variance=variance), position=(x, y, z))
    assert TASK.is_certain(known) is certain


def test_a_wrist_that_was_never_seen_is_not_certain(flight: Flight) -> None:
    known = knowing(flight, 0.01)
    seen = known.filter.seen.copy()
    seen[[Joint.LEFT_WRIST, Joint.RIGHT_WRIST]] = False
    assert not TASK.is_certain(replace(known, filter=replace(known.filter, seen=seen)))


def test_the_reward_is_that_of_the_thesis_with_what_is_estimated(flight: Flight) -> None:
    known = replace(knowing(flight, 0.02), position=(4.0, -1.0, 2.0), steps=5)
    error = over_upper_body(expected_errors(known.filter.variance))
    assert error == pytest.approx(0.02 * 1.596, rel=0.01)
    assert TASK.uncertainty(known) == error
    away = math.dist(known.position, front_point(CONFIG, known.scene))
    expected = -(0.75 * 5.0 * error + 0.25 * away / 9)
    assert TASK.with_reward(known)[1] == pytest.approx(expected, abs=0.002)


def test_knowing_nothing_costs_as_much_as_a_fifth_of_a_metre_and_the_way_to_the_other_side(flight: Flight) -> None:
    lost = replace(flight, position=(3.0, 4.0, CONFIG.front_height), steps=5)
    assert TASK.with_reward(lost)[1] == pytest.approx(-(0.75 + 0.25 * (5.0 + CONFIG.front_distance) / 9))


def test_a_crash_costs_the_penalty(flight: Flight) -> None:
    known = replace(knowing(flight, 0.02), steps=5)
    badly = replace(known, outcome="too_close")
    assert TASK.with_reward(badly)[1] - TASK.with_reward(known)[1] == pytest.approx(CONFIG.penalty)
    assert not TASK.succeeded(badly)


def test_the_environment_passes_gymnasiums_checker(sensor: AnalyticSensor) -> None:
    check_env(gymnasium.make("vantage/Hover-v1", sensor=sensor).unwrapped)


def test_the_radius_of_the_upper_body_is_a_mean_by_weights() -> None:
    variance = np.full((18, 3), 0.01**2)
    assert over_upper_body(radii(variance)) == pytest.approx(0.025, rel=0.01)
