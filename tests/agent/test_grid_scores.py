"""Episodes on the grid and their scores, by hand."""

import numpy as np
import pytest

from agent.environment.grid.grid_map import GridMap
from agent.environment.grid.walks import Walks
from agent.grid_episodes import GridEpisodes, every_start, walk_episodes
from agent.grid_scores import failures, score
from agent.learning.grid_policies import GRID_BASELINES, Circle, Greedy, RandomWalk, ShortestPath
from protocol.grid.paths import shortest_paths
from protocol.grid.table import CENTRE, cell_of
from tests.agent.environment.grid.tables import table

THRESHOLD = 1.6


@pytest.fixture(scope="module")
def grid_map() -> GridMap:
    return GridMap.of_table(table(), "train")


def walked(policy: object, grid_map: GridMap, threshold: float = THRESHOLD) -> GridEpisodes:
    return walk_episodes(
        policy, every_start(grid_map), grid_map, threshold=threshold, reward="quality", episode_steps=100
    )


def test_the_optimum_takes_the_shortest_path_from_every_start(grid_map: GridMap) -> None:
    episodes = walked(ShortestPath(grid_map, THRESHOLD), grid_map)
    shortest = shortest_paths(grid_map.uncertainty < THRESHOLD)[episodes.place, episodes.start]
    assert episodes.succeeded.all()
    assert np.array_equal(episodes.length, shortest)
    result = score("optimum", episodes, grid_map, THRESHOLD)
    assert (result.success.mean, result.crash.mean, result.ratio) == (1.0, 0.0, 1.0)
    assert result.episodes == 4 * 360


@pytest.mark.parametrize("name", list(GRID_BASELINES))
def test_a_baseline_walks_the_same_way_each_time(grid_map: GridMap, name: str) -> None:
    policy = GRID_BASELINES[name](grid_map, THRESHOLD)
    first, second = walked(policy, grid_map), walked(policy, grid_map)
    assert np.array_equal(first.path, second.path)


def test_only_a_random_walk_crashes(grid_map: GridMap) -> None:
    crashed = {
        name: walked(policy, grid_map, threshold=0.0).crashed.any()
        for name, policy in {"random": RandomWalk(), "circle": Circle(), "greedy": Greedy(grid_map)}.items()
    }
    assert crashed == {"random": True, "circle": False, "greedy": False}


def test_greedy_reaches_what_a_smooth_map_leads_to_sooner_than_chance(grid_map: GridMap) -> None:
    greedy, random = (walked(policy, grid_map).length.mean() for policy in (Greedy(grid_map), RandomWalk()))
    assert greedy < 0.75 * random


def test_an_episode_has_its_path_and_its_end(grid_map: GridMap) -> None:
    episodes = walked(Circle(), grid_map)
    for number in range(0, len(episodes.length), 97):
        length = episodes.length[number]
        assert (episodes.path[number, : length + 1] >= 0).all()
        assert (episodes.path[number, length + 1 :] == -1).all()
        assert episodes.end[number] == episodes.path[number, length]
    assert np.array_equal(episodes.succeeded, grid_map.uncertainty[episodes.place, episodes.end] < THRESHOLD)


def hand_made(*paths: list[int], crashed: int | None = None) -> GridEpisodes:
    path = np.full((len(paths), 101), -1, np.int16)
    for number, cells in enumerate(paths):
        path[number, : len(cells)] = cells
    length = np.array([len(cells) - 1 for cells in paths])
    return GridEpisodes(
        place=np.zeros(len(paths), np.intp),
        path=path,
        length=length,
        total_reward=np.zeros(len(paths)),
        succeeded=np.zeros(len(paths), bool),
        crashed=np.array([number == crashed for number in range(len(paths))]),
    )


def test_failures_are_told_by_their_last_steps(grid_map: GridMap) -> None:
    to_and_fro = [cell_of(5, 5), cell_of(5, 6)] * 50 + [cell_of(5, 5)]
    ring = [(2, y) for y in range(-2, 2)] + [(x, 2) for x in range(2, -2, -1)]
    ring += [(-2, y) for y in range(2, -2, -1)] + [(x, -2) for x in range(-2, 2)]
    around = [cell_of(*ring[step % 16]) for step in range(101)]
    line = [cell_of(x, 9) for x in range(-9, 9)]
    away = [*line, *line[::-1]] * 3
    crash = [cell_of(1, 1), CENTRE]
    episodes = hand_made(to_and_fro, around, away[:101], crash, crashed=3)
    expected = {"crash": 1, "righteous": 0, "oscillating": 1, "circling": 1, "wandering": 1}
    assert failures(episodes, grid_map, THRESHOLD) == expected
    # Nothing succeeds below zero: whatever was not a crash could not be won.
    assert failures(episodes, grid_map, 0.0) == dict.fromkeys(expected, 0) | {"crash": 1, "righteous": 3}


def test_a_score_tells_the_solvable_from_the_others() -> None:
    views = table()
    dark = {name: values.copy() for name, values in views.quantities.items()}
    for values in dark.values():
        values[0] = 0.0
    grid_map = GridMap.of_table(
        type(views)(recipe=views.recipe, places=views.places, truth=views.truth, quantities=dark), "train"
    )
    result = score("optimum", walked(ShortestPath(grid_map, THRESHOLD), grid_map), grid_map, THRESHOLD)
    assert result.success.mean == 0.75
    assert result.success_of_solvable.mean == 1.0
    assert result.failures["righteous"] == 360
    assert result.success.low < 0.75 < result.success.high


def test_every_start_is_walked_once(grid_map: GridMap) -> None:
    begun = every_start(grid_map)
    assert len({*zip(begun.place.tolist(), begun.cell.tolist(), strict=True)}) == 4 * 360
    assert CENTRE not in begun.cell
    assert isinstance(begun, Walks)
