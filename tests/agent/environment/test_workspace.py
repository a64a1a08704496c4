import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.environment.workspace import closest_approach, contains, moved, outcome_of, random_start
from protocol.environment_config import EnvironmentConfig

CONFIG = EnvironmentConfig()


def test_a_velocity_is_flown_for_the_step() -> None:
    assert moved((1.0, 2.0, 3.0), np.array([0.5, -1.0, 0.0]), 0.5) == (1.25, 1.5, 3.0)


def test_a_velocity_is_cut_to_one_metre_a_second_on_each_axis() -> None:
    assert moved((0.0, 0.0, 1.0), np.array([3.0, -7.0, 0.2]), 0.5) == (0.5, -0.5, 1.1)


@pytest.mark.parametrize(
    ("position", "inside"),
    [
        ((9.0, -9.0, 0.5), True),
        ((9.01, 0.0, 2.0), False),
        ((0.0, -9.01, 2.0), False),
        ((0.0, 0.0, 0.49), False),
        ((0.0, 0.0, 4.01), False),
    ],
)
def test_the_workspace_is_18_by_18_metres_and_from_half_a_metre_to_4_high(position, inside) -> None:
    assert contains(CONFIG, position) is inside


def test_the_closest_approach_is_where_the_way_passes_the_person_not_where_it_ends() -> None:
    # From (-3, 1) to (3, 1) past a person at the origin: 1 m in the middle, though both ends are over 3 m away.
    assert closest_approach((-3.0, 1.0, 1.0), (3.0, 1.0, 3.0), (0.0, 0.0)) == pytest.approx(1.0)


def test_the_closest_approach_of_a_way_that_leads_off_is_its_start() -> None:
    assert closest_approach((3.0, 4.0, 1.0), (6.0, 8.0, 1.0), (0.0, 0.0)) == pytest.approx(5.0)


def test_the_closest_approach_of_a_drone_that_hovers_is_its_distance() -> None:
    assert closest_approach((3.0, 4.0, 1.0), (3.0, 4.0, 1.0), (0.0, 0.0)) == pytest.approx(5.0)


def test_height_does_not_make_it_safe_to_be_above_a_person() -> None:
    assert outcome_of(CONFIG, (1.6, 0.0, 3.9), (1.4, 0.0, 3.9), (0.0, 0.0)) == "too_close"


def test_the_keep_out_is_round_the_person_wherever_they_stand() -> None:
    assert outcome_of(CONFIG, (2.6, 0.0, 1.0), (2.4, 0.0, 1.0), (1.0, 0.0)) == "too_close"
    assert outcome_of(CONFIG, (2.6, 0.0, 1.0), (2.4, 0.0, 1.0), (0.0, 0.0)) == "flying"


def test_flying_through_a_wall_leaves_the_workspace() -> None:
    assert outcome_of(CONFIG, (8.8, 0.0, 1.0), (9.2, 0.0, 1.0), (0.0, 0.0)) == "out_of_workspace"


@given(seed=st.integers(0, 2**31), x=st.floats(-1, 1), y=st.floats(-1, 1))
def test_no_first_step_from_a_start_ends_a_flight(seed: int, x: float, y: float) -> None:
    start = random_start(CONFIG, (x, y), np.random.default_rng(seed))
    towards = np.array([x - start[0], y - start[1], 0.0])
    corners = [np.array(corner, float) for corner in itertools.product((-1, 1), repeat=3)]
    for velocity in (*corners, towards / np.linalg.norm(towards) * math.sqrt(2)):
        assert outcome_of(CONFIG, start, moved(start, velocity, CONFIG.step_duration), (x, y)) == "flying"


def test_starts_are_all_over_the_workspace() -> None:
    starts = np.array([random_start(CONFIG, (0.0, 0.0), np.random.default_rng(seed)) for seed in range(400)])
    assert starts.min(axis=0) == pytest.approx([-8.5, -8.5, 1.0], abs=0.3)
    assert starts.max(axis=0) == pytest.approx([8.5, 8.5, 3.5], abs=0.3)
