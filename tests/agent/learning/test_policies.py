import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from agent.environment.flight import Flight, move, take_off
from agent.environment.reward import front_point
from agent.environment.spaces import observation_of
from agent.environment.workspace import closest_approach
from agent.learning.policies import BASELINES, baseline, learned, scripted, steered
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor

CONFIG = EnvironmentConfig()


def flight_of(seed: int) -> Flight:
    return take_off(CONFIG, seed, AnalyticSensor().sample(seed, "train"))


def flown(name: str, flight: Flight, steps: int = 99) -> list[Flight]:
    """A flight without pictures, which no baseline needs."""
    policy, flights = baseline(name, CONFIG), [flight]
    while len(flights) <= steps and not flights[-1].over:
        velocity = policy(observation_of(flights[-1])[None], flights[-1:])[0]
        flights.append(move(CONFIG, flights[-1], velocity.astype(float)))
    return flights


def test_staying_is_not_moving() -> None:
    assert flown("stay", flight_of(0), 3)[-1].position == flight_of(0).position


@settings(max_examples=60)
@given(seed=st.integers(0, 2**31))
def test_the_front_is_reached_from_everywhere_without_a_crash(seed: int) -> None:
    flights = flown("front", flight_of(seed))
    assert flights[-1].outcome == "flying"
    assert math.dist(flights[-1].position, front_point(CONFIG, flights[0].scene)) < 0.02


def test_the_way_to_the_front_goes_around_the_person() -> None:
    scene = replace(AnalyticSensor().sample(0, "train"), position=(0.0, 0.0), yaw=0.0)
    flights = flown("front", replace(flight_of(0), scene=scene, position=(-5.0, 0.1, 1.6)))
    ways = itertools.pairwise(flight.position for flight in flights)
    nearest = min(closest_approach(start, end, (0.0, 0.0)) for start, end in ways)
    assert nearest > CONFIG.keep_out_radius + 0.4
    # Straight through it would be 7.5 m; around, not much more.
    arrived = next(flight for flight in flights if math.dist(flight.position, front_point(CONFIG, scene)) < 0.02)
    assert arrived.steps * 0.5 < 11.0


def test_a_free_way_is_flown_straight_and_at_full_speed() -> None:
    flight = replace(flight_of(0), position=(5.0, 5.0, 1.0))
    assert steered(CONFIG, flight, (7.0, 6.0, 1.0)) == pytest.approx([1.0, 0.5, 0.0])


def test_the_last_bit_of_a_way_is_not_overshot() -> None:
    flight = replace(flight_of(0), position=(5.0, 5.0, 1.0))
    assert steered(CONFIG, flight, (5.1, 5.0, 0.9)) == pytest.approx([0.2, 0.0, -0.2])
    assert steered(CONFIG, flight, (5.0, 5.0, 1.0)) == pytest.approx([0.0, 0.0, 0.0])


def test_circling_goes_all_around_at_the_front_points_distance() -> None:
    flights = flown("circle", flight_of(3))
    assert flights[-1].outcome == "flying"
    circling = [np.array(flight.position[:2]) - flight.scene.position for flight in flights[40:]]
    assert [np.linalg.norm(place) for place in circling] == pytest.approx([CONFIG.front_distance] * 60, abs=0.1)
    bearings = np.unwrap([math.atan2(place[1], place[0]) for place in circling])
    assert bearings[-1] - bearings[0] > 2 * math.pi


def test_random_velocities_are_new_each_step_and_use_the_whole_range() -> None:
    policy = baseline("random", CONFIG)
    flights = [replace(flight_of(0), steps=step) for step in range(300)]
    velocities = policy(np.zeros((300, 111), np.float32), flights)
    assert velocities.min(axis=0) == pytest.approx(-np.ones(3), abs=0.05)
    assert velocities.max(axis=0) == pytest.approx(np.ones(3), abs=0.05)
    assert np.abs(np.corrcoef(velocities[:-1, 0], velocities[1:, 0])[0, 1]) < 0.2


@pytest.mark.parametrize("name", [*BASELINES, "scripted"])
def test_a_velocity_does_not_depend_on_the_flights_beside_it(name: str) -> None:
    policy = scripted(CONFIG, 0.5) if name == "scripted" else baseline(name, CONFIG)
    flights = [flight_of(seed) for seed in range(4)]
    together = policy(np.zeros((4, 111), np.float32), flights)
    alone = np.concatenate([policy(np.zeros((1, 111), np.float32), [flight]) for flight in flights])
    assert together.dtype == np.float32
    assert np.abs(together).max() <= 1.0
    assert np.array_equal(together, alone)


def scatter(seed: int, noise: float) -> float:
    """Standard deviation of a scripted flight's velocities about the way to the front, where no limit cuts them."""
    flights = [
        replace(flight_of(seed), position=front_point(CONFIG, flight_of(seed).scene), steps=step) for step in range(300)
    ]
    return float(scripted(CONFIG, noise)(np.zeros((300, 111), np.float32), flights).std())


@pytest.mark.slow
def test_scripted_flights_scatter_each_in_its_own_measure() -> None:
    deviations = [scatter(seed, 0.3) for seed in range(30)]
    assert max(deviations) == pytest.approx(0.3, abs=0.05)
    assert min(deviations) < 0.05
    assert np.mean(deviations) == pytest.approx(0.15, abs=0.04)


def test_without_noise_a_scripted_flight_is_the_one_to_the_front() -> None:
    flights, observations = [flight_of(0)], np.zeros((1, 111), np.float32)
    assert np.array_equal(
        scripted(CONFIG, 0.0)(observations, flights), baseline("front", CONFIG)(observations, flights)
    )


def test_a_learned_policy_is_the_best_the_learner_knows() -> None:
    class Learner:
        def act(self, observations: np.ndarray, *, explore: bool) -> np.ndarray:
            return np.full((len(observations), 3), float(explore), np.float32)

    assert learned(Learner())(np.zeros((2, 111), np.float32), []).tolist() == [[0.0] * 3] * 2  # pyright: ignore[reportArgumentType]
