from collections import deque

import numpy as np
import pytest

from protocol.grid.paths import shortest_paths
from protocol.grid.table import CELLS, CENTRE, SIDE, cell_of

ALL = range(-9, 10)


def succeeding_at(*cells: tuple[int, int]) -> np.ndarray:
    success = np.zeros((1, CELLS), bool)
    success[0, [cell_of(x, y) for x, y in cells]] = True
    return success


def moves(start: tuple[int, int], *success: tuple[int, int]) -> float:
    return float(shortest_paths(succeeding_at(*success))[0, cell_of(*start)])


def test_a_diagonal_move_counts_as_one():
    assert moves((5, 5), (2, 3)) == 3


def test_the_way_across_leads_around_the_person_and_is_no_longer_where_diagonals_do():
    # (-2, 0), (-1, 1), (0, 1), (1, 1), (2, 0)
    assert moves((-2, 0), (2, 0)) == 4
    # Eighteen moves would all be diagonal, and the ninth would hit the person.
    assert moves((-9, -9), (9, 9)) == 19
    assert moves((-1, -1), (1, 1)) == 3


def test_from_a_success_the_next_success_is_looked_for_or_it_is_left_and_entered_again():
    assert moves((3, 3), (3, 3)) == 2
    assert moves((3, 3), (3, 3), (4, 3)) == 1


def test_the_nearest_of_some_successes_counts():
    assert moves((0, 5), (0, 9), (0, 2)) == 3


def test_without_a_success_the_way_is_infinite_and_the_centre_is_none():
    assert np.isinf(shortest_paths(succeeding_at())).all()
    assert np.isinf(shortest_paths(succeeding_at((0, 0)))).all()


def test_no_way_begins_in_the_centre():
    assert moves((0, 0), (1, 0)) == np.inf


@pytest.mark.parametrize("share", [0.003, 0.05, 0.5])
def test_every_way_is_that_of_a_plain_search(share):
    success = np.random.default_rng(3).random((6, CELLS)) < share
    found = shortest_paths(success)
    for environment in range(6):
        for start in range(0, CELLS, 7):
            assert found[environment, start] == plain_search(success[environment], start)


def plain_search(success: np.ndarray, start: int) -> float:
    if start == CENTRE:
        return np.inf
    queue, seen = deque([(start, 0)]), set()
    while queue:
        cell, count = queue.popleft()
        y, x = divmod(cell, SIDE)
        for row in (y - 1, y, y + 1):
            for column in (x - 1, x, x + 1):
                beside = min(max(column, 0), SIDE - 1) + SIDE * min(max(row, 0), SIDE - 1)
                if (row, column) == (y, x) or beside == CENTRE or beside in seen:
                    continue
                if success[beside]:
                    return count + 1
                seen.add(beside)
                queue.append((beside, count + 1))
    return np.inf


def test_at_the_border_a_successful_start_may_stay():
    assert moves((9, 2), (9, 2)) == 1
    assert moves((-9, 9), (-9, 9)) == 1
    assert moves((8, 2), (8, 2)) == 2
