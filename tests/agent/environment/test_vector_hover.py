import itertools
import threading
from collections.abc import Iterator

import gymnasium
import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

import agent  # noqa: F401 (registers the environment)
from agent.checkpointing.state_tree import join, split
from agent.environment.episode_seeds import episode_seed
from agent.environment.hover import Hover
from agent.environment.vector_hover import VectorHover
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput, WorkerLost
from tests.agent.analytic_sensor import TIMING, AnalyticSensor

SHORT = EnvironmentConfig(num_envs=3, episode_steps=4)


def actions_of(step: int, drones: int = 3) -> np.ndarray:
    return np.random.default_rng(step).uniform(-1, 1, (drones, 3)).astype(np.float32)


def test_gymnasium_makes_one_by_its_name(sensor: AnalyticSensor) -> None:
    env = gymnasium.make_vec("vantage/Hover-v0", num_envs=2, sensor=sensor)
    assert isinstance(env.unwrapped, VectorHover)
    observations, _ = env.reset(seed=0)
    assert env.observation_space.contains(observations)
    assert env.action_space.shape == (2, 3)


def test_an_environment_restored_flies_on_to_the_bit(sensor: AnalyticSensor) -> None:
    """Over the ends of flights, so that the numbers of those that follow count too."""
    one, other = VectorHover(sensor, config=SHORT), VectorHover(sensor, config=SHORT)
    one.reset(seed=7)
    for step in range(6):
        one.step(actions_of(step))
    other.reset(seed=8)
    other.restore(join(*split(one.state())))
    assert np.array_equal(other.observations, one.observations)
    for step in range(6, 16):
        steps = [env.step(actions_of(step)) for env in (one, other)]
        for found, expected in zip(*steps, strict=True):
            assert data_equivalence(found, expected)
    for space in (lambda env: env.action_space, lambda env: env.single_action_space):
        assert np.array_equal(space(one).sample(), space(other).sample())
    assert one.np_random.random() == other.np_random.random()


def test_the_seed_of_a_run_is_that_of_the_action_spaces_as_well(sensor: AnalyticSensor) -> None:
    samples = []
    for seed in (7, 7, 8):
        env = VectorHover(sensor, config=SHORT)
        env.reset(seed=seed)
        samples.append((env.action_space.sample().tolist(), env.single_action_space.sample().tolist()))
    assert samples[0] == samples[1] != samples[2]


def test_each_drone_flies_as_it_would_alone(sensor: AnalyticSensor) -> None:
    flock = VectorHover(sensor, config=SHORT)
    observations, infos = flock.reset(seed=7)
    alone = [Hover(sensor, SHORT) for _ in range(3)]
    for index, env in enumerate(alone):
        assert np.array_equal(env.reset(seed=episode_seed(7, index))[0], observations[index])
    for step in range(3):
        observations, rewards, terminated, truncated, infos = flock.step(actions_of(step))
        for index, env in enumerate(alone):
            observation, reward, ended, cut, info = env.step(actions_of(step)[index])
            assert np.array_equal(observation, observations[index])
            assert (reward, ended, cut) == (rewards[index], terminated[index], truncated[index])
            assert info["outcome"] == infos["outcome"][index]
            assert np.array_equal(info["quality"], infos["quality"][index])
            assert infos["_quality"][index]


def test_all_pictures_of_a_step_are_under_way_at_once() -> None:
    under_way = []
    sensor = AnalyticSensor(deliver=lambda pending, observation: under_way.append((pending, observation)))

    def answer() -> None:
        for pending, observation in under_way:
            pending.succeed(observation, TIMING)
        under_way.clear()

    env = VectorHover(sensor, config=SHORT)
    resetting = threading.Thread(target=env.reset, kwargs={"seed": 0})
    resetting.start()
    while len(under_way) < 3:
        resetting.join(0.001)
    answer()
    resetting.join()
    for step in range(SHORT.episode_steps):
        answer()
        env.send(np.zeros((3, 3)))
        last = step == SHORT.episode_steps - 1
        # Of the next flights' first pictures one has come already.
        assert len(under_way) == (5 if last else 3), "the next flights' first pictures go out with the last ones"
        answer()
        env.receive()


def test_the_next_episode_s_first_picture_is_asked_for_while_the_others_fly(sensor: AnalyticSensor) -> None:
    scenes: list[int] = []

    class Watched(AnalyticSensor):
        def sample(self, seed, split):
            scenes.append(seed)
            return super().sample(seed, split)

    env = VectorHover(Watched(), config=SHORT)
    env.reset(seed=3)
    assert scenes == [episode_seed(3, number) for number in range(3)]
    env.step(np.zeros((3, 3)))
    assert scenes[3:] == [episode_seed(3, 3)]
    for _ in range(SHORT.episode_steps - 1):
        env.step(np.zeros((3, 3)))
    # Each episode was taken off once, and one more is ahead.
    assert scenes == [episode_seed(3, number) for number in range(7)]


def test_what_was_taken_off_ahead_changes_no_flight(sensor: AnalyticSensor) -> None:
    """Not even across a reset, which begins other episodes under the same numbers."""
    env, fresh = VectorHover(sensor, config=SHORT), VectorHover(sensor, config=SHORT)
    env.reset(seed=1)
    env.step(actions_of(0))
    for one in (env, fresh):
        one.reset(seed=2)
    for step in range(2 * SHORT.episode_steps):
        for found, expected in zip(*(one.step(actions_of(step)) for one in (env, fresh)), strict=True):
            assert data_equivalence(found, expected)


@pytest.mark.parametrize("delays", [(0.02, 0.01, 0.0), (0.0, 0.015, 0.005, 0.02)])
def test_the_order_of_answers_changes_nothing(delays) -> None:
    delay = itertools.cycle(delays)

    def deliver(pending, observation) -> None:
        threading.Timer(next(delay), pending.succeed, (observation, TIMING)).start()

    in_order, out_of_order = (
        VectorHover(AnalyticSensor(), config=SHORT),
        VectorHover(AnalyticSensor(deliver), config=SHORT),
    )
    assert np.array_equal(in_order.reset(seed=5)[0], out_of_order.reset(seed=5)[0])
    for step in range(9):
        expected, found = in_order.step(actions_of(step)), out_of_order.step(actions_of(step))
        for one, other in zip(expected[:4], found[:4], strict=True):
            assert np.array_equal(one, other)
    assert [flight.seed for flight in in_order.flights] == [flight.seed for flight in out_of_order.flights]


def test_a_finished_flight_is_followed_in_the_same_step(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=2)
    for _ in range(SHORT.episode_steps - 1):
        *_, infos = env.step(np.zeros((3, 3)))
        assert "final_obs" not in infos
    observations, _, terminated, truncated, infos = env.step(np.zeros((3, 3)))
    assert truncated.all()
    assert not terminated.any()
    for index in range(3):
        assert infos["final_obs"][index][108:] == pytest.approx(infos["final_info"]["position"][index])
        assert not np.array_equal(infos["final_obs"][index], observations[index])
        assert infos["final_info"]["outcome"][index] == "truncated"
        assert infos["final_info"]["seed"][index] == episode_seed(2, index)
        assert infos["final_info"]["length"][index] == SHORT.episode_steps
        assert infos["seed"][index] == episode_seed(2, 3 + index)
        alone, _ = Hover(sensor, SHORT).reset(seed=episode_seed(2, 3 + index))
        assert np.array_equal(alone, observations[index])


def test_only_the_drone_that_crashed_begins_anew(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=EnvironmentConfig(num_envs=3))
    env.reset(seed=2)
    climbing = np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 0]])
    terminated = np.zeros(3, bool)
    while not terminated.any():
        requests = sensor.requests
        _, rewards, terminated, _, infos = env.step(climbing)
    assert terminated.tolist() == [False, True, False]
    assert infos["_final_info"].tolist() == [False, True, False]
    assert infos["final_info"]["outcome"][1] == "out_of_workspace"
    assert rewards[1] < env.config.penalty < rewards[0]
    assert [flight.seed for flight in env.flights] == [episode_seed(2, number) for number in (0, 3, 2)]
    assert sensor.requests == requests + 3, "two drones fly on, a flight follows, a crash has none"


def test_the_next_reset_goes_on_with_the_next_episodes(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=2)
    env.reset()
    assert [flight.seed for flight in env.flights] == [episode_seed(2, number) for number in (3, 4, 5)]


@pytest.mark.parametrize("seed", [2, np.int64(2)])
def test_a_run_is_named_by_any_whole_number(sensor: AnalyticSensor, seed) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=seed)
    assert [flight.seed for flight in env.flights] == [episode_seed(2, number) for number in (0, 1, 2)]


def test_without_a_seed_every_run_is_another(sensor: AnalyticSensor) -> None:
    runs = [VectorHover(sensor, config=SHORT) for _ in range(2)]
    for env in runs:
        env.reset()
    assert {flight.seed for flight in runs[0].flights}.isdisjoint(flight.seed for flight in runs[1].flights)


def test_episodes_can_be_named_by_their_own_seeds(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=[11, 12, 13])
    assert [flight.seed for flight in env.flights] == [11, 12, 13]
    with pytest.raises(InvalidInput):
        env.reset(seed=[11, 12])


def test_without_autoreset_finished_flights_wait(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT, autoreset_mode=AutoresetMode.DISABLED)
    env.reset(seed=[1, 2, 3])
    for _ in range(SHORT.episode_steps):
        observations, _, _, truncated, _ = env.step(np.zeros((3, 3)))
    assert truncated.all()
    ended, requests = env.flights, sensor.requests
    again, rewards, terminated, truncated, _ = env.step(np.ones((3, 3)))
    assert np.array_equal(again, observations)
    assert not rewards.any()
    assert not (terminated | truncated).any()
    assert env.flights == ended
    assert sensor.requests == requests


def test_autoreset_in_the_next_step_is_not_offered(sensor: AnalyticSensor) -> None:
    with pytest.raises(InvalidInput):
        VectorHover(sensor, autoreset_mode=AutoresetMode.NEXT_STEP)


def losing(answers: Iterator[bool]) -> AnalyticSensor:
    """A sensor that loses the pictures for which there is no answer."""

    def deliver(pending, observation) -> None:
        if next(answers):
            pending.succeed(observation, TIMING)
        else:
            pending.fail(WorkerLost("perception died"), TIMING)

    return AnalyticSensor(deliver)


def test_a_lost_picture_leaves_all_episodes_as_they_were() -> None:
    answers = iter([True] * 3 + [True, False, True] + [True] * 6)
    env, control_run = VectorHover(losing(answers), config=SHORT), VectorHover(AnalyticSensor(), config=SHORT)
    env.reset(seed=4)
    control_run.reset(seed=4)
    before = env.flights
    with pytest.raises(WorkerLost):
        env.step(actions_of(0))
    assert env.flights == before
    assert np.array_equal(env.step(actions_of(0))[0], control_run.step(actions_of(0))[0])


def in_groups(env: VectorHover, actions: np.ndarray, following: np.ndarray | None, groups: list[slice]):
    """A step that some drones end before others do, who fly on meanwhile; what it came to."""
    if not env.is_under_way:
        env.send(actions)
    for group in groups if following is not None else []:
        observations, flights = env.receive_first(group.stop)
        assert len(observations) == len(flights) == group.stop
        env.fly_on(following[group])
    return env.receive()


@pytest.mark.parametrize("groups", [[slice(0, 1), slice(1, 3)], [slice(0, 3)], [slice(0, 1), slice(1, 2), slice(2, 3)]])
def test_drones_that_fly_on_in_groups_fly_as_those_that_wait_for_each_other(sensor: AnalyticSensor, groups) -> None:
    """Over the ends of flights, so that the numbers of those that follow count too."""
    grouped, together = VectorHover(sensor, config=SHORT), VectorHover(sensor, config=SHORT)
    for env in (grouped, together):
        env.reset(seed=7)
    steps = 11
    for step in range(steps):
        following = actions_of(step + 1) if step < steps - 1 else None
        found = in_groups(grouped, actions_of(step), following, groups)
        for one, other in zip(found, together.step(actions_of(step)), strict=True):
            assert data_equivalence(one, other)
        assert data_equivalence(grouped.state(), together.state()), "as if nothing were under way"
    assert not grouped.is_under_way


def test_a_picture_lost_after_some_drones_have_flown_on_leaves_all_episodes_as_they_were() -> None:
    answers = iter([True] * 3 + [True, True, False, True, True] + [True] * 12)
    env, control_run = VectorHover(losing(answers), config=SHORT), VectorHover(AnalyticSensor(), config=SHORT)
    for one in (env, control_run):
        one.reset(seed=4)
    before = env.state()
    env.send(actions_of(0))
    env.receive_first(2)
    env.fly_on(actions_of(1)[:2])
    with pytest.raises(WorkerLost):
        env.receive_first(3)
    assert data_equivalence(env.state(), before)
    assert not env.is_under_way
    for step in range(2):
        assert np.array_equal(env.step(actions_of(step))[0], control_run.step(actions_of(step))[0])


def test_only_drones_whose_pictures_are_there_fly_on(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=0)
    with pytest.raises(NoAsyncCallError):
        env.receive_first(1)
    env.send(actions_of(0))
    env.receive_first(2)
    for actions in (actions_of(1), [[0.0, np.nan, 0.0]], [0.0, 0.0]):
        with pytest.raises(InvalidInput):
            env.fly_on(actions)
    env.fly_on(actions_of(1)[:1])
    with pytest.raises(InvalidInput):
        env.fly_on(actions_of(1)[1:])
    with pytest.raises(AlreadyPendingCallError):
        env.receive()


def test_an_impossible_action_of_one_drone_moves_none(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    env.reset(seed=0)
    before = env.flights
    actions = np.zeros((3, 3))
    actions[2, 0] = np.nan
    with pytest.raises(InvalidInput):
        env.send(actions)
    assert env.flights == before
    env.step(np.zeros((3, 3)))


def test_a_step_is_sent_once_and_received_once(sensor: AnalyticSensor) -> None:
    env = VectorHover(sensor, config=SHORT)
    with pytest.raises(ResetNeeded):
        env.send(np.zeros((3, 3)))
    env.reset(seed=0)
    with pytest.raises(NoAsyncCallError):
        env.receive()
    env.send(np.zeros((3, 3)))
    with pytest.raises(AlreadyPendingCallError):
        env.send(np.zeros((3, 3)))
