"""The rules of a step, by hand."""

import numpy as np
import pytest

from agent.environment.grid.cells import DESTINATIONS, MOVE_NAMES, MOVES
from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.starts import episode_seeds, starts
from agent.environment.grid.walks import Walks, outcomes, take_step
from protocol.grid.table import CENTRE, cell_of
from tests.agent.environment.grid.tables import table

WEST, EAST, NORTH_EAST = MOVE_NAMES.index("west"), MOVE_NAMES.index("east"), MOVE_NAMES.index("north-east")


@pytest.fixture(scope="module")
def grid_map() -> GridMap:
    return GridMap.of_table(table(), "train")


def walk_from(*cells: tuple[int, int]) -> Walks:
    return Walks.begin_at(np.zeros(len(cells), np.intp), np.array([cell_of(x, y) for x, y in cells]))


def step(
    grid_map: GridMap, walks: Walks, *actions: int, threshold: float = 1e-6, reward: str = "quality", limit: int = 100
):
    return take_step(walks, np.array(actions), grid_map, threshold=threshold, reward=reward, episode_steps=limit)


def test_a_move_leads_to_the_neighbour_in_its_direction() -> None:
    assert len(MOVES) == len(set(map(tuple, MOVES.tolist()))) == 8
    for action, (x, y) in enumerate(MOVES):
        assert DESTINATIONS[cell_of(3, -4), action] == cell_of(3 + x, -4 + y)


def test_a_move_over_the_border_slides_along_it() -> None:
    assert DESTINATIONS[cell_of(9, 2), EAST] == cell_of(9, 2)
    assert DESTINATIONS[cell_of(9, 2), NORTH_EAST] == cell_of(9, 3)
    assert DESTINATIONS[cell_of(9, 9), NORTH_EAST] == cell_of(9, 9)


def test_the_persons_cell_is_a_crash(grid_map: GridMap) -> None:
    done = step(grid_map, walk_from((1, 0)), WEST, threshold=10.1)
    ended = [done.crashed[0], done.terminated[0], done.succeeded[0], done.truncated[0]]
    assert ended == [True, True, False, False]
    assert done.rewards[0] == -10.0
    assert outcomes(done)[0] == "too_close"


def test_a_cell_below_the_threshold_is_a_success_and_one_at_it_is_not(grid_map: GridMap) -> None:
    walks = walk_from((5, 5))
    there = float(grid_map.uncertainty[0, cell_of(4, 5)])
    above, at = (step(grid_map, walks, WEST, threshold=threshold) for threshold in (np.nextafter(there, 11.0), there))
    assert (above.succeeded[0], above.rewards[0], outcomes(above)[0]) == (True, 10.0, "succeeded")
    assert (at.succeeded[0], outcomes(at)[0]) == (False, "flying")


def test_the_last_step_truncates_unless_it_ends_the_episode_itself(grid_map: GridMap) -> None:
    going, crashing = (step(grid_map, walk_from(cell), WEST, limit=1) for cell in ((5, 5), (1, 0)))
    assert (going.truncated[0], going.terminated[0], outcomes(going)[0]) == (True, False, "truncated")
    assert (crashing.truncated[0], crashing.terminated[0]) == (False, True)


@pytest.mark.parametrize(
    ("reward", "success", "crash", "other"),
    [
        ("binary", 1.0, -1.0, lambda _: 0.0),
        ("path_length", 1.0, -1.0, lambda _: -0.1),
        ("quality", 10.0, -10.0, lambda u: -u / 40),
    ],
)
def test_the_three_rewards_of_the_thesis(grid_map: GridMap, reward: str, success: float, crash: float, other) -> None:
    walks = walk_from((5, 5), (1, 0), (8, 8))
    between = float(grid_map.uncertainty[0, cell_of(4, 5)]) + 1e-4
    far = float(grid_map.uncertainty[0, cell_of(7, 8)])
    done = step(grid_map, walks, WEST, WEST, WEST, threshold=between, reward=reward)
    assert done.succeeded.tolist() == [True, False, far < between]
    assert done.rewards[:2].tolist() == [success, crash]
    apart = step(grid_map, walks, WEST, WEST, WEST, reward=reward)
    assert apart.rewards[2] == pytest.approx(other(far))


def test_rewards_add_up_over_an_episode(grid_map: GridMap) -> None:
    one = step(grid_map, walk_from((8, 8)), WEST, reward="path_length")
    two = step(grid_map, one.walks, WEST, reward="path_length")
    assert two.walks.total_reward[0] == pytest.approx(-0.2)
    assert two.walks.steps[0] == 2


def test_episodes_begin_anywhere_but_in_the_persons_cell_and_in_every_environment() -> None:
    places, cells = starts(episode_seeds(3, np.arange(40_000)), 5)
    assert CENTRE not in cells
    counts = np.bincount(cells, minlength=361)
    assert (np.delete(counts, CENTRE) > 0).all()
    # 40 000 over 360 cells: 111 each with a deviation of 10.5.
    assert np.delete(counts, CENTRE).max() < 111 + 6 * 10.5
    assert np.bincount(places).min() > 40_000 / 5 - 6 * 80


def test_an_episode_is_a_function_of_run_seed_and_number() -> None:
    some, all_of_them = episode_seeds(3, np.array([5, 9])), episode_seeds(3, np.arange(10))
    assert some.tolist() == all_of_them[[5, 9]].tolist()
    assert set(episode_seeds(4, np.arange(10)).tolist()).isdisjoint(all_of_them.tolist())
