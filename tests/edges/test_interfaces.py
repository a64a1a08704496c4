"""Arguments of Gymnasium's interface, and of our own: honoured, or refused by name.

Gymnasium's own vector environment of single drones is what ours is held to.
"""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, ResetNeeded
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import agent  # noqa: F401 (registers the environment)
from agent.environment.episode_seeds import episode_seed
from agent.environment.hover import Hover
from agent.environment.vector_hover import VectorHover
from perception_worker.networks import __main__ as networks_command
from perception_worker.worker import open_perceiver
from protocol.config import PerceptionConfig
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidConfig, InvalidInput
from render_worker import bake
from tests.agent.analytic_sensor import AnalyticSensor

SHORT = EnvironmentConfig(num_envs=3, episode_steps=4)
ONLY_THE_SECOND = np.array([False, True, False])
HOLD = np.zeros((3, 3), np.float32)


def drones(mode: AutoresetMode | str = AutoresetMode.DISABLED, **given: Any) -> VectorHover:
    return VectorHover(AnalyticSensor(), config=SHORT, autoreset_mode=mode, **given)


def gymnasiums_own() -> SyncVectorEnv:
    return SyncVectorEnv([lambda: Hover(AnalyticSensor(), SHORT)] * 3, autoreset_mode=AutoresetMode.DISABLED)


def seeds_of(env: VectorHover) -> list[int]:
    return [flight.seed for flight in env.flights]


@pytest.mark.parametrize("mask", [[True, False, False], [False, True, True], [True, True, True]])
def test_a_reset_mask_begins_the_episodes_that_gymnasium_would(mask: list[bool]) -> None:
    ours, theirs = drones(), gymnasiums_own()
    for env in (ours, theirs):
        env.reset(seed=[11, 12, 13])
        env.step(HOLD)
    begun = [env.reset(seed=[21, 22, 23], options={"reset_mask": np.array(mask)}) for env in (ours, theirs)]
    assert data_equivalence(begun[0], begun[1])
    for _ in range(3):
        assert data_equivalence(ours.step(HOLD), theirs.step(HOLD))


def test_a_reset_mask_may_be_a_list_as_well() -> None:
    env = drones()
    env.reset(seed=[11, 12, 13])
    env.reset(seed=[21, 22, 23], options={"reset_mask": [True, False, False]})
    assert seeds_of(env) == [21, 12, 13]


def test_options_are_left_as_they_were_given() -> None:
    env, options = drones(), {"reset_mask": ONLY_THE_SECOND}
    env.reset(seed=1)
    env.reset(options=options)
    assert options == {"reset_mask": ONLY_THE_SECOND}


@pytest.mark.parametrize("mode", [AutoresetMode.DISABLED, AutoresetMode.SAME_STEP])
def test_a_drone_that_begins_anew_takes_the_run_s_next_episode(mode: AutoresetMode) -> None:
    env = drones(mode)
    env.reset(seed=7)
    env.step(HOLD)
    _, infos = env.reset(options={"reset_mask": ONLY_THE_SECOND})
    assert seeds_of(env) == [episode_seed(7, number) for number in (0, 3, 2)]
    assert [flight.steps for flight in env.flights] == [1, 0, 1]
    assert infos["_seed"].tolist() == ONLY_THE_SECOND.tolist()
    env.reset()
    assert seeds_of(env) == [episode_seed(7, number) for number in (4, 5, 6)]


def test_a_run_s_seed_with_a_mask_is_for_those_that_begin() -> None:
    """Each the episode that it would have if all began."""
    env = drones()
    env.reset(seed=7)
    env.reset(seed=8, options={"reset_mask": ONLY_THE_SECOND})
    assert seeds_of(env) == [episode_seed(7, 0), episode_seed(8, 1), episode_seed(7, 2)]
    env.reset()
    assert seeds_of(env) == [episode_seed(8, number) for number in (3, 4, 5)]


def test_others_fly_on_to_the_bit_after_some_began_anew() -> None:
    masked, untouched = drones(AutoresetMode.SAME_STEP), drones(AutoresetMode.SAME_STEP)
    for env in (masked, untouched):
        env.reset(seed=7)
        env.step(HOLD)
    masked.reset(options={"reset_mask": ONLY_THE_SECOND})
    for _ in range(SHORT.episode_steps - 2):
        one, other = masked.step(HOLD)[0], untouched.step(HOLD)[0]
        assert np.array_equal(one[[0, 2]], other[[0, 2]])


@pytest.mark.parametrize(
    "options",
    [
        {"reset_mask": [True, False]},
        {"reset_mask": [1, 0, 0]},
        {"reset_mask": np.zeros(3, bool)},
        {"reset_mask": [[True], [True, False]]},
        {"reset_mask": None},
        {"low": -0.1},
        {"reset_mask": ONLY_THE_SECOND, "state": "front"},
    ],
)
def test_any_other_option_is_refused_by_name_and_changes_nothing(options: dict[str, Any]) -> None:
    env = drones()
    env.reset(seed=7)
    before = env.state()
    with pytest.raises(InvalidInput, match=list(options)[-1]):
        env.reset(seed=8, options=options)
    assert data_equivalence(env.state(), before)


def test_of_one_drone_no_option_is_known() -> None:
    env = Hover(AnalyticSensor(), SHORT)
    env.reset(seed=7, options={})
    flight = env.flight
    for options in ({"reset_mask": [True]}, {"position": (0, 0, 1)}):
        with pytest.raises(InvalidInput, match=next(iter(options))):
            env.reset(options=options)
    assert env.flight is flight


def test_some_can_t_begin_anew_before_all_have_begun_nor_while_a_step_is_under_way() -> None:
    env = drones()
    with pytest.raises(ResetNeeded):
        env.reset(options={"reset_mask": ONLY_THE_SECOND})
    env.reset(seed=7)
    env.send(HOLD)
    with pytest.raises(AlreadyPendingCallError):
        env.reset(options={"reset_mask": ONLY_THE_SECOND})
    assert env.receive()[-1]["length"].tolist() == [1, 1, 1]


@pytest.mark.parametrize("seeds", [[11, None, 13], (11, None, 13), np.array([11, 12, 13])])
def test_seeds_of_drones_come_as_any_sequence_and_may_be_left_to_the_run(seeds: Any) -> None:
    env = drones()
    env.reset(seed=7)
    env.reset(seed=seeds)
    assert seeds_of(env) == [11, episode_seed(7, 4) if seeds[1] is None else 12, 13]


@pytest.mark.parametrize("seed", [-1, 1.5, "abc", b"abc", "7", 2**63, [1, 2], [1, -2, 3], [1, 2.5, 3], [1, "2", 3]])
def test_a_seed_that_is_none_is_refused_and_changes_nothing(seed: Any) -> None:
    env = drones()
    env.reset(seed=7)
    before = env.state()
    with pytest.raises(InvalidInput, match="seed"):
        env.reset(seed=seed)
    assert data_equivalence(env.state(), before)


@pytest.mark.parametrize("seed", [-1, 1.5, "7", 2**63, [1]])
def test_one_drone_is_held_to_the_same_seeds(seed: Any) -> None:
    env = Hover(AnalyticSensor(), SHORT)
    with pytest.raises(InvalidInput, match="seed"):
        env.reset(seed=seed)
    assert np.array_equal(env.reset(seed=np.int64(7))[0], env.reset(seed=7)[0])


def test_autoreset_modes_go_by_gymnasium_s_names() -> None:
    for name, mode in (("Disabled", AutoresetMode.DISABLED), ("SameStep", AutoresetMode.SAME_STEP)):
        named = drones(name)
        assert named.metadata["autoreset_mode"] is mode
        named.reset(seed=[1, 2, 3])
        for _ in range(SHORT.episode_steps):
            named.step(HOLD)
        assert (seeds_of(named) == [1, 2, 3]) == (mode is AutoresetMode.DISABLED)
    for name in ("NextStep", "Sometimes"):
        with pytest.raises(InvalidInput, match=f"autoreset_mode '{name}'"):
            drones(name)


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
@pytest.mark.parametrize("argument", [{"render_mode": "rgb_array"}, {"render_mode": "human"}, {"split": "validation"}])
@pytest.mark.filterwarnings("ignore:.*render_mode")
def test_what_gymnasium_s_make_hands_on_is_refused_by_name(make: Any, argument: dict[str, str]) -> None:
    [name] = argument
    with pytest.raises(InvalidInput, match=name):
        make("vantage/Hover-v0", sensor=AnalyticSensor(), **argument)
    make("vantage/Hover-v0", sensor=AnalyticSensor(), render_mode=None, split="test")


def test_a_time_limit_of_gymnasium_s_is_refused_where_no_wrapper_keeps_it() -> None:
    with pytest.raises(TypeError, match="max_episode_steps"):
        gymnasium.make_vec("vantage/Hover-v0", sensor=AnalyticSensor(), max_episode_steps=3)


@pytest.mark.parametrize("num_envs", [0, -1, 1.5, "3"])
def test_a_number_of_drones_that_is_none_is_refused(num_envs: Any) -> None:
    with pytest.raises(InvalidInput, match="num_envs"):
        VectorHover(AnalyticSensor(), num_envs, SHORT)


def test_gymnasium_s_statistics_of_episodes_know_who_began_anew() -> None:
    """Its wrapper looks for the mask after the reset: it must still be there."""
    env = RecordEpisodeStatistics(drones())
    env.reset(seed=7)
    env.step(HOLD)
    env.reset(options={"reset_mask": ONLY_THE_SECOND})
    ended: dict[str, Any] = {}
    for _ in range(SHORT.episode_steps - 1):
        ended = env.step(HOLD)[-1]
    assert ended["episode"]["l"].tolist() == [SHORT.episode_steps, 0, SHORT.episode_steps]


def test_a_lifter_that_is_named_and_not_used_is_refused_by_name() -> None:
    with pytest.raises(InvalidConfig, match=r"perception\.lifter: mine\.msgpack is named, and .* lifts by nearest"):
        open_perceiver(PerceptionConfig(look="whole", mask="none", lifting="nearest", lifter="mine.msgpack"))


def test_names_beside_all_networks_are_refused_by_name(caplog: pytest.LogCaptureFixture) -> None:
    assert networks_command.main(["pull", "--all", "movenet_lightnig"]) == 2
    assert "movenet_lightnig" in caplog.text


def test_a_bake_is_not_checked_and_made_anew_at_once(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        bake.main(["--check", "--force"])
    assert refused.value.code == 2
    assert "--force" in capsys.readouterr().err
