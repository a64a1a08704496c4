import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from msgspec.structs import replace

import agent  # noqa: F401 (registers the environment)
from agent.environment.flight import succeeded
from agent.environment.hover import Hover
from agent.environment.reward import step_reward
from protocol.environment_config import EnvironmentConfig
from protocol.errors import CallFailed, InvalidConfig, InvalidInput, WorkerLost
from protocol.skeleton import weighted_uncertainty
from tests.agent.analytic_sensor import TIMING, AnalyticSensor

HOLD = np.zeros(3, np.float32)


def towards_person(env: Hover) -> np.ndarray:
    x, y, _ = env.flight.position
    away = np.array([x, y]) - env.flight.scene.position
    return np.array([*(-away / np.abs(away).max()), 0.0], np.float32)


def test_gymnasium_finds_nothing_to_complain_about(sensor: AnalyticSensor) -> None:
    check_env(gymnasium.make("vantage/Hover-v0", sensor=sensor).unwrapped)


def test_an_episode_is_a_function_of_its_seed(sensor: AnalyticSensor) -> None:
    actions = np.random.default_rng(0).uniform(-1, 1, (5, 3)).astype(np.float32)
    episodes = []
    for env in (Hover(sensor), Hover(AnalyticSensor())):
        env.reset(seed=1)
        env.reset(seed=42)
        episodes.append([env.step(action)[:2] for action in actions])
    for (observation, reward), (again, reward_again) in zip(*episodes, strict=True):
        assert np.array_equal(observation, again)
        assert reward == reward_again


def test_train_and_test_fly_different_people(sensor: AnalyticSensor) -> None:
    env, test = Hover(sensor), Hover(sensor, split="test")
    env.reset(seed=3)
    test.reset(seed=3)
    assert env.flight.scene.identity < 40 <= test.flight.scene.identity


def test_without_a_seed_the_next_episode_is_another(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    seeds = [env.reset(seed=8)[1]["seed"], env.reset()[1]["seed"], env.reset()[1]["seed"]]
    assert len(set(seeds)) == 3
    assert [env.reset(seed=8)[1]["seed"], env.reset()[1]["seed"], env.reset()[1]["seed"]] == seeds


def test_a_step_moves_looks_and_earns(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    before, _ = env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(np.array([0.0, 0.0, 0.5], np.float32))
    assert observation[108:] == pytest.approx(before[108:] + np.array([0.0, 0.0, 0.25]))
    assert not np.array_equal(observation[54:108], before[54:108])
    variance = env.flight.filter.variance
    assert reward == step_reward(env.config, env.flight.scene, env.flight.position, variance, 1, ended_badly=False)
    assert (terminated, truncated, info["outcome"]) == (False, False, "flying")
    assert sensor.requests == 2


def test_info_tells_quality_uncertainty_and_timings(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    env.reset(seed=0)
    *_, info = env.step(HOLD)
    assert info["quality"].shape == (18,)
    assert info["uncertainty"] == weighted_uncertainty(info["quality"])
    assert info["timings"]["render"] == 0.02
    assert info["timings"]["transport"] == pytest.approx(0.001 + TIMING.transport)
    assert (info["seed"], info["length"]) == (0, 1)
    assert info["position"] == pytest.approx(env.flight.position)


def test_coming_too_close_ends_the_episode_with_the_penalty_and_no_picture(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    env.reset(seed=0)
    terminated = False
    while not terminated:
        requests = sensor.requests
        observation, reward, terminated, truncated, info = env.step(towards_person(env))
    assert (info["outcome"], truncated) == ("too_close", False)
    assert reward < env.config.penalty
    assert sensor.requests == requests
    assert env.observation_space.contains(observation)


def test_leaving_the_workspace_ends_the_episode(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    env.reset(seed=0)
    terminated = False
    while not terminated:
        _, reward, terminated, _, info = env.step(np.array([0.0, 0.0, 1.0], np.float32))
    assert info["outcome"] == "out_of_workspace"
    assert reward < env.config.penalty


def test_an_episode_is_truncated_after_its_steps(sensor: AnalyticSensor) -> None:
    env = Hover(sensor, EnvironmentConfig(episode_steps=4))
    env.reset(seed=0)
    ends = [env.step(HOLD)[2:4] for _ in range(4)]
    assert ends == [(False, False)] * 3 + [(False, True)]
    assert sensor.requests == 5
    with pytest.raises(ResetNeeded):
        env.step(HOLD)


def test_the_drone_sees_best_from_the_front(sensor: AnalyticSensor) -> None:
    env = Hover(sensor)
    uncertainties = []
    for turn in (0.0, np.pi):
        env.reset(seed=0)
        scene = env.flight.scene
        angle = scene.yaw + turn
        position = (scene.position[0] + 3 * np.cos(angle), scene.position[1] + 3 * np.sin(angle), 1.6)
        env.flight = replace(env.flight, position=position)
        uncertainties.append(env.step(HOLD)[-1]["uncertainty"])
    assert uncertainties[0] < 3.0 < uncertainties[1]
    assert succeeded("truncated", uncertainties[0], 3.0)


@pytest.mark.parametrize("action", [[float("nan"), 0, 0], [0, float("-inf"), 0], [0, 0]])
def test_an_impossible_action_leaves_the_episode_as_it_was(sensor: AnalyticSensor, action) -> None:
    env = Hover(sensor)
    env.reset(seed=0)
    before = env.flight
    with pytest.raises(InvalidInput):
        env.step(np.array(action, np.float32))
    assert env.flight is before


def test_a_lost_picture_leaves_the_episode_as_it_was() -> None:
    lost = iter([False, True, False])

    def deliver(pending, observation) -> None:
        if next(lost):
            pending.fail(WorkerLost("perception died"), TIMING)
        else:
            pending.succeed(observation, TIMING)

    env = Hover(AnalyticSensor(deliver))
    env.reset(seed=0)
    before = env.flight
    with pytest.raises(CallFailed):
        env.step(HOLD)
    assert env.flight is before
    assert env.step(HOLD)[-1]["length"] == 1


def test_stepping_before_a_reset_is_an_error(sensor: AnalyticSensor) -> None:
    with pytest.raises(ResetNeeded):
        Hover(sensor).step(HOLD)


def test_an_impossible_workspace_is_refused(sensor: AnalyticSensor) -> None:
    with pytest.raises(InvalidConfig):
        Hover(sensor, EnvironmentConfig(keep_out_radius=20.0))
