import numpy as np
import pytest
from msgspec.structs import replace

from agent.environment.flight import take_off
from agent.environment.spaces import action_space, observation_of, observation_space, require_actions
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.pose_estimate import FilterState
from tests.agent.analytic_sensor import AnalyticSensor


def test_an_observation_is_coordinates_then_variances_then_the_position(sensor: AnalyticSensor) -> None:
    mean, variance = np.arange(54.0).reshape(18, 3) / 10, np.arange(54.0).reshape(18, 3) / 60
    state = FilterState(mean=mean, variance=variance, process_noise=np.zeros(18), seen=np.ones(18, bool))
    flight = replace(
        take_off(EnvironmentConfig(), 0, sensor.sample(0, "train")), filter=state, position=(1.0, -2.0, 3.0)
    )
    seen = observation_of(flight)
    assert seen.shape == (111,)
    assert seen.dtype == np.float32
    assert seen[:54] == pytest.approx(mean.ravel())
    assert seen[54:108] == pytest.approx(variance.ravel())
    assert seen[108:] == pytest.approx([1.0, -2.0, 3.0])


def test_an_observation_is_cut_to_its_space(sensor: AnalyticSensor) -> None:
    wild = FilterState(
        mean=np.full((18, 3), -1e6), variance=np.full((18, 3), 1e6), process_noise=np.zeros(18), seen=np.ones(18, bool)
    )
    flight = replace(take_off(EnvironmentConfig(), 0, sensor.sample(0, "train")), filter=wild)
    assert observation_space().contains(observation_of(flight))


def test_actions_are_three_velocities_up_to_a_metre_a_second() -> None:
    assert action_space().shape == (3,)
    assert (action_space().low == -1).all()
    assert (action_space().high == 1).all()


@pytest.mark.parametrize(
    "actions",
    [[0.0, float("nan"), 0.0], [float("inf"), 0.0, 0.0], [0.0, 0.0], [[0.0, 0.0, 0.0]], ["a", "b", "c"], None],
)
def test_what_is_no_velocity_is_refused(actions) -> None:
    with pytest.raises(InvalidInput):
        require_actions(actions, (3,))


def test_velocities_beyond_the_limit_are_for_the_drone_to_cut() -> None:
    assert require_actions([5, 0, 0], (3,)).tolist() == [5.0, 0.0, 0.0]
