import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from agent.environment.flight import take_off
from agent.environment.spaces import OBSERVATION_SIZE, observation_of
from agent.learning.features import (
    FEATURE_SIZE,
    Features,
    RecentFeatures,
    bearing_of,
    to_drone_frame,
    to_drone_frames,
    to_world_frame,
)
from protocol.arrays import Float32Array
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import BODY, AnalyticSensor

ANGLES = st.floats(-math.pi, math.pi)
FEATURES = Features(EnvironmentConfig())
NO_PLACE = [index for index in range(FEATURE_SIZE) if index not in (0, 1, 4, 5)]
"""All features but those that tell at which bearing and where in the workspace the drone is."""


def turn(angle: float) -> np.ndarray:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def observation(
    yaw: float, drone: tuple[float, float, float], turned: float = 0.0, variance: float = 0.05
) -> torch.Tensor:
    joints = BODY @ turn(yaw + turned).T
    numbers = np.concatenate([joints.ravel(), np.full(54, variance), turn(turned) @ drone])
    return torch.tensor(numbers, dtype=torch.float32)[None]


def facing(features: torch.Tensor) -> np.ndarray:
    """(n, 2) where the person faces by shoulders, hips, eyes, ears and nose, as the features have it."""
    return features[0, -10:].reshape(5, 2).numpy()


@given(yaw=ANGLES, turned=ANGLES, distance=st.floats(1.5, 6.9), height=st.floats(0.5, 4.0))
@pytest.mark.slow
def test_a_scene_turned_about_the_person_is_the_same_scene(yaw, turned, distance, height) -> None:
    as_it_was = FEATURES(observation(yaw, (distance, 0.0, height)))
    as_turned = FEATURES(observation(yaw, (distance, 0.0, height), turned))
    assert as_turned[0, NO_PLACE].numpy() == pytest.approx(as_it_was[0, NO_PLACE].numpy(), abs=1e-4)


@given(bearing=ANGLES, x=st.floats(-2, 2), y=st.floats(-2, 2))
def test_velocities_come_back_from_the_drones_frame(bearing, x, y) -> None:
    direction = torch.tensor([[math.cos(bearing), math.sin(bearing)]])
    vector = torch.tensor([[x, y, 0.3]])
    back = to_world_frame(to_drone_frame(vector, direction), direction)
    assert back.numpy() == pytest.approx(vector.numpy(), abs=1e-5)


def test_a_turn_stays_on_its_device() -> None:
    # `meta` computes nothing, and like a GPU it refuses what is on the CPU.
    vectors, bearing = torch.zeros(2, 3, device="meta"), torch.zeros(2, 2, device="meta")
    assert to_world_frame(vectors, bearing).is_meta
    assert to_drone_frames(bearing).is_meta


def test_towards_the_drone_is_x() -> None:
    north = torch.tensor([[0.0, 1.0]])
    assert to_drone_frame(torch.tensor([[0.0, 2.0, 5.0]]), north).tolist() == [[2.0, 0.0, 5.0]]
    assert to_drone_frame(torch.tensor([[-2.0, 0.0, 5.0]]), north).tolist() == [[0.0, 2.0, 5.0]]


def test_the_bearing_is_that_of_the_drone_from_the_person() -> None:
    features = FEATURES(observation(1.0, (0.0, -4.0, 2.0)))
    assert bearing_of(features).numpy() == pytest.approx(np.array([[0.0, -1.0]]), abs=0.05)


@pytest.mark.parametrize(
    ("yaw", "way"), [(0.0, (1, 0)), (math.pi, (-1, 0)), (math.pi / 2, (0, 1)), (-math.pi / 2, (0, -1))]
)
def test_the_person_faces_the_drone_or_away_or_aside(yaw, way) -> None:
    ways = facing(FEATURES(observation(yaw, (4.0, 0.0, 1.6))))
    assert (ways @ way > 0.02).all()
    assert ways @ np.array([-way[1], way[0]]) == pytest.approx(np.zeros(5), abs=0.02)


def limits(drone: tuple[float, float, float]) -> list[float]:
    """What the features tell of the walls (towards the drone, across, up) and of the keep-out."""
    return FEATURES(observation(0.0, drone))[0, 7:11].tolist()


@pytest.mark.parametrize(
    ("drone", "near"),
    [
        # Two metres from a limit it begins to be felt; at the limit it is 1.
        ((5.0, 0.0, 2.25), [0.0, 0.0, 0.0, 0.0]),
        ((8.0, 0.0, 2.25), [0.5, 0.0, 0.0, 0.0]),
        ((-9.0, 0.0, 2.25), [1.0, 0.0, 0.0, 0.0]),
        ((5.0, 0.0, 0.5), [0.0, 0.0, -1.0, 0.0]),
        ((5.0, 0.0, 3.0), [0.0, 0.0, 0.5, 0.0]),
        ((2.5, 0.0, 2.25), [0.0, 0.0, 0.0, 0.5]),
    ],
)
def test_limits_are_felt_before_they_are_reached(drone, near) -> None:
    assert limits(drone) == pytest.approx(near, abs=0.05)


def test_joints_never_seen_say_nothing_of_where_the_person_faces(sensor: AnalyticSensor) -> None:
    flight = take_off(EnvironmentConfig(), 0, sensor.sample(0, "train"))
    features = FEATURES(torch.from_numpy(observation_of(flight))[None])
    assert facing(features) == pytest.approx(np.zeros((5, 2)))


def test_features_are_about_one_in_size_and_finite_everywhere(sensor: AnalyticSensor) -> None:
    rng = np.random.default_rng(0)
    observations = [observation(rng.uniform(-3, 3), tuple(rng.uniform((-9, -9, 0.5), (9, 9, 4)))) for _ in range(200)]
    features = FEATURES(torch.cat(observations))
    assert features.shape == (200, FEATURE_SIZE)
    assert features.abs().max() < 5.0
    above_the_person = observation(0.0, (0.0, 0.0, 2.0), variance=100.0)
    assert torch.isfinite(FEATURES(above_the_person)).all()


@pytest.mark.parametrize("at_once", [2, 4, 7, 16, 64, 200])
def test_features_do_not_depend_on_what_they_are_computed_with(at_once: int) -> None:
    """To the bit: a replay memory that is filled again from its journal must be what it was."""
    rng = np.random.default_rng(0)
    observations = torch.from_numpy(rng.normal(0.0, 2.0, (200, OBSERVATION_SIZE)).astype(np.float32))
    observations[:, 54:108].abs_()
    alone = torch.cat([FEATURES(one) for one in observations.split(1)])
    assert torch.equal(torch.cat([FEATURES(some) for some in observations.split(at_once)]), alone)


def test_matrices_turn_as_the_frames_do() -> None:
    features = FEATURES(torch.rand(20, OBSERVATION_SIZE))
    vectors = torch.randn(20, 3)
    turned = to_drone_frames(features) @ vectors[:, :, None]
    assert torch.allclose(turned[:, :, 0], to_drone_frame(vectors, bearing_of(features)), atol=1e-6)


class Counted(Features):
    """Features that count of how many observations they were computed."""

    rows = 0

    def of(self, observations: Float32Array) -> Float32Array:
        self.rows += len(observations)
        return super().of(observations)


def test_recent_features_are_computed_once_and_are_the_same() -> None:
    counted, observations = Counted(EnvironmentConfig()), torch.rand(6, OBSERVATION_SIZE)
    recent = RecentFeatures(counted, size=6)
    for rows in ([0, 1], [1, 2, 1], [3, 4, 5], [0, 1, 2, 3, 4, 5]):
        assert np.array_equal(recent.of(observations[rows].numpy()), FEATURES(observations[rows]).numpy())
    assert counted.rows == 6


def test_no_more_features_are_remembered_than_asked_for() -> None:
    counted, observations = Counted(EnvironmentConfig()), torch.rand(6, OBSERVATION_SIZE).numpy()
    recent = RecentFeatures(counted, size=2)
    recent.of(observations)
    recent.of(observations[4:])
    assert counted.rows == 6
    recent.of(observations[:4])
    assert counted.rows == 10
