import math

import numpy as np
import pytest
from msgspec.structs import replace

from agent.environment.reward import front_point, step_reward, uncertainty_weight
from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor

CONFIG = EnvironmentConfig(
    beta=2.0,
    episode_steps=100,
    uncertainty_scale=1 / 54,
    distance_scale=1 / 9,
    penalty=-200.0,
    front_distance=2.5,
    front_height=1.6,
)
SCENE = replace(AnalyticSensor().sample(0, "train"), position=(1.0, 2.0), yaw=math.pi / 2)


@pytest.mark.parametrize(
    ("step", "beta", "weight"), [(100, 2.0, 1.0), (50, 2.0, 0.75), (1, 2.0, 0.505), (25, 4.0, 0.8125)]
)
def test_uncertainty_weighs_more_and_more_until_it_is_all(step, beta, weight) -> None:
    assert uncertainty_weight(step, 100, beta) == pytest.approx(weight)


def test_the_front_point_lies_where_the_person_looks() -> None:
    assert front_point(CONFIG, SCENE) == pytest.approx((1.0, 4.5, 1.6))


def test_a_reward_worked_by_hand() -> None:
    # Variances of 0.5 m² each: R1 = 27/54 = 0.5. Three metres beside the front point: R2 = 3/9. Half way: α = 0.75.
    reward = step_reward(CONFIG, SCENE, (4.0, 4.5, 1.6), np.full((18, 3), 0.5), 50, ended_badly=False)
    assert reward == pytest.approx(-(0.75 * 0.5 + 0.25 / 3))


def test_the_last_step_is_about_uncertainty_alone() -> None:
    near, far = [
        step_reward(CONFIG, SCENE, position, np.full((18, 3), 0.2), 100, ended_badly=False)
        for position in ((1.0, 4.5, 1.6), (-8.0, -8.0, 3.0))
    ]
    assert near == pytest.approx(far) == pytest.approx(-0.2)


def test_the_penalty_comes_on_top() -> None:
    variance = np.full((18, 3), 0.2)
    well, badly = [step_reward(CONFIG, SCENE, (3.0, 3.0, 1.0), variance, 7, ended_badly=end) for end in (False, True)]
    assert badly == pytest.approx(well - 200.0)
