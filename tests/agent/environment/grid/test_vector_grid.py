import gymnasium
import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

import agent  # noqa: F401 (registers the environment)
from agent.checkpointing.state_tree import join, split
from agent.environment.grid.grid import Grid
from agent.environment.grid.vector_grid import VectorGrid
from protocol.errors import InvalidInput
from protocol.grid.table import GridTable
from protocol.grid_config import GridConfig
from tests.agent.environment.grid.tables import table

SHORT = GridConfig(num_envs=6, episode_steps=5, success_threshold=1.0)


@pytest.fixture(scope="module")
def views() -> GridTable:
    return table()


def actions_of(step: int, drones: int = 6) -> np.ndarray:
    return np.random.default_rng(step).integers(8, size=drones)


def test_gymnasium_makes_one_by_its_name(views: GridTable) -> None:
    env = gymnasium.make_vec("vantage/Grid-v0", num_envs=2, table=views)
    assert isinstance(env.unwrapped, VectorGrid)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    assert env.action_space.shape == (2,)


def test_an_environment_restored_walks_on_to_the_bit(views: GridTable) -> None:
    one, other = (VectorGrid(views, config=SHORT, curriculum=True) for _ in range(2))
    one.reset(seed=7)
    for step in range(8):
        one.step(actions_of(step))
    other.reset(seed=8)
    other.restore(join(*split(one.state())))
    assert np.array_equal(other.observations, one.observations)
    for step in range(8, 30):
        steps = [env.step(actions_of(step)) for env in (one, other)]
        for found, expected in zip(*steps, strict=True):
            assert data_equivalence(found, expected)


def test_each_drone_walks_as_one_alone_does(views: GridTable) -> None:
    env = VectorGrid(views, num_envs=3, config=SHORT, autoreset_mode=AutoresetMode.DISABLED)
    seeds = [11, 12, 13]
    observations, _ = env.reset(seed=seeds)
    alone = [Grid(views, config=SHORT) for _ in seeds]
    begun = [one.reset(seed=seed)[0] for one, seed in zip(alone, seeds, strict=True)]
    assert np.array_equal(observations, begun)
    over = [False] * 3
    for step in range(6):
        actions = actions_of(step, 3)
        observations, rewards, terminated, truncated, infos = env.step(actions)
        for drone, one in enumerate(alone):
            if over[drone]:
                assert (rewards[drone], terminated[drone], truncated[drone]) == (0.0, False, False)
                continue
            observation, reward, ends, cut, info = one.step(actions[drone])
            assert np.array_equal(observations[drone], observation)
            assert (rewards[drone], terminated[drone], truncated[drone]) == (reward, ends, cut)
            assert {name: infos[name][drone] for name in ("seed", "length", "total_reward")} == {
                name: info[name] for name in ("seed", "length", "total_reward")
            }
            over[drone] = ends or cut
    assert all(over)


def test_a_finished_episode_is_followed_by_the_next_in_the_same_step(views: GridTable) -> None:
    env = VectorGrid(views, config=SHORT)
    env.reset(seed=1)
    for step in range(4):
        env.step(actions_of(step))
    before = env.walks
    observations, _, terminated, truncated, infos = env.step(actions_of(4))
    over = terminated | truncated
    assert truncated.any()
    assert np.array_equal(infos["_final_obs"], over)
    assert (infos["length"][over] == 0).all()
    assert (infos["final_info"]["length"][truncated] == 5).all()
    assert set(infos["final_info"]["outcome"][truncated]) == {"truncated"}
    moved = before.cell[over] != env.walks.cell[over]
    assert moved.any()
    assert np.array_equal(observations, env.observations)
    assert not np.array_equal(infos["final_obs"][over], observations[over])


def test_episodes_do_not_depend_on_when_others_end(views: GridTable) -> None:
    """The n-th episode of a run begins at the same place, whoever walks it."""
    few, many = (VectorGrid(views, num_envs=count, config=SHORT) for count in (2, 6))
    for env in (few, many):
        env.reset(seed=5)
    assert few.walks.seeds.tolist() == many.walks.seeds[:2].tolist()


def test_the_threshold_falls_with_the_steps_of_a_training(views: GridTable) -> None:
    config = GridConfig(
        num_envs=4, success_threshold=1.1, curriculum_range=0.5, curriculum_step=0.2, curriculum_every=8
    )
    env = VectorGrid(views, config=config, curriculum=True)
    env.reset(seed=0)
    seen = []
    for step in range(10):
        seen.append(round(env.threshold, 6))
        env.step(actions_of(step, 4))
    assert seen == [1.6, 1.6, 1.4, 1.4, 1.2, 1.2, 1.1, 1.1, 1.1, 1.1]
    assert VectorGrid(views, config=config).threshold == 1.1


def test_without_quality_an_observation_is_the_position_alone(views: GridTable) -> None:
    env = VectorGrid(views, config=GridConfig(num_envs=6, observation="position"))
    observations, _ = env.reset(seed=0)
    assert np.array_equal(observations[:, :2], env.walks.positions())
    assert not observations[:, 2:].any()


def test_only_the_drones_of_a_mask_begin_anew(views: GridTable) -> None:
    env = VectorGrid(views, config=SHORT)
    env.reset(seed=1)
    env.step(actions_of(0))
    before = env.walks
    mask = np.array([True, False, False, True, False, False])
    _, infos = env.reset(options={"reset_mask": mask})
    assert np.array_equal(env.walks.seeds != before.seeds, mask)
    assert np.array_equal(env.walks.cell[~mask], before.cell[~mask])
    assert np.array_equal(infos["_length"], mask)


def test_a_wrong_action_is_refused_and_the_episodes_stay(views: GridTable) -> None:
    env = VectorGrid(views, config=SHORT)
    env.reset(seed=1)
    before = env.walks
    for actions in (np.full(6, 8), np.full(6, -1), np.zeros(5, int), np.zeros(6)):
        with pytest.raises(InvalidInput):
            env.step(actions)
    assert env.walks is before


def test_calls_out_of_order_are_refused(views: GridTable) -> None:
    env = VectorGrid(views, config=SHORT)
    with pytest.raises(ResetNeeded):
        env.step(actions_of(0))
    with pytest.raises(ResetNeeded):
        env.reset(options={"reset_mask": np.array([True] + [False] * 5)})
    env.reset(seed=1)
    with pytest.raises(NoAsyncCallError):
        env.receive()
    env.send(actions_of(0))
    with pytest.raises(AlreadyPendingCallError):
        env.send(actions_of(0))


def test_rendering_is_refused_with_what_draws_instead(views: GridTable) -> None:
    with pytest.raises(InvalidInput, match="Grid-v0 alone draws"):
        VectorGrid(views, render_mode="rgb_array")
