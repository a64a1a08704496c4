import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env

from agent.environment.grid.cells import MOVE_NAMES
from agent.environment.grid.drawing import PIXELS, Scenery, draw, drawn_as_text
from agent.environment.grid.grid import Grid
from protocol.errors import InvalidInput
from protocol.grid.table import CENTRE, SIDE, GridTable, cell_of
from protocol.grid_config import GridConfig
from tests.agent.environment.grid.tables import table


@pytest.fixture(scope="module")
def views() -> GridTable:
    return table()


def test_gymnasiums_checker_has_nothing_to_say(views: GridTable) -> None:
    env = gymnasium.make("vantage/Grid-v0", table=views, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=False)


def test_an_episode_is_a_function_of_its_seed(views: GridTable) -> None:
    one, other = Grid(views), Grid(views)
    other.reset(seed=3)
    assert np.array_equal(one.reset(seed=9)[0], other.reset(seed=9)[0])
    assert one.reset()[1]["seed"] == other.reset()[1]["seed"]


def test_an_episode_that_is_over_is_not_stepped(views: GridTable) -> None:
    env = Grid(views, GridConfig(episode_steps=1))
    with pytest.raises(ResetNeeded):
        env.step(np.int64(0))
    env.reset(seed=0)
    *_, truncated, info = env.step(np.int64(0))
    assert truncated == (info["outcome"] == "truncated")
    with pytest.raises(ResetNeeded):
        env.step(np.int64(0))


def test_wrong_arguments_are_refused(views: GridTable) -> None:
    with pytest.raises(InvalidInput, match="human"):
        Grid(views, render_mode="human")
    with pytest.raises(InvalidInput, match="validation"):
        Grid(views, split="validation")


def test_the_picture_has_the_drone_the_person_and_the_cells_that_succeed() -> None:
    uncertainty = np.full(SIDE * SIDE, 10.0, np.float32)
    uncertainty[cell_of(3, 0)] = 0.5
    picture = draw(Scenery(uncertainty=uncertainty, threshold=1.0, yaw=0.0), [cell_of(-5, 7), cell_of(-4, 8)])

    def colour(x: float, y: float) -> tuple[int, ...]:
        row, column = round((SIDE / 2 - y) * PIXELS), round((SIDE / 2 + x) * PIXELS)
        return tuple(picture[row, column].tolist())

    dark, bright = colour(6, -6), colour(3, 0)
    assert sum(dark) < sum(bright)
    assert colour(0, 0) == colour(0.8, 0.0) != colour(-0.8, 0.0)
    assert colour(3.46, 0) == (255, 255, 255)
    drone = colour(-4, 8)
    assert drone not in (dark, bright, colour(0, 0))
    assert colour(-4.6, 7.4) not in (dark, drone)


def test_the_text_has_the_walk_from_north_to_south() -> None:
    uncertainty = np.full(SIDE * SIDE, 10.0, np.float32)
    uncertainty[cell_of(3, 0)] = 0.5
    lines = drawn_as_text(
        Scenery(uncertainty=uncertainty, threshold=1.0, yaw=0.0), [cell_of(-9, 9), cell_of(-8, 9)]
    ).splitlines()
    assert lines[0] == "oD" + "@" * 17
    assert lines[9] == "@" * 9 + "H@@!" + "@" * 6
    assert set(lines[18]) == {"@"}


def test_render_draws_the_walk_so_far(views: GridTable) -> None:
    env = Grid(views, render_mode="ansi")
    with pytest.raises(ResetNeeded):
        env.render()
    env.reset(seed=1)
    assert env.render().count("D") == 1
    env.step(np.int64(MOVE_NAMES.index("north")))
    assert env.render().count("o") <= 1
    assert cell_of(0, 0) == CENTRE
