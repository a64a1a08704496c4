import copy

import numpy as np
import pytest
import torch
from msgspec.structs import replace

from agent.environment.spaces import action_space
from agent.learning.features import Features
from agent.learning.learner import Learner
from agent.learning.networks import Critic
from agent.learning.sac import SacLearner
from protocol.errors import ArtifactDamaged, InvalidConfig
from protocol.learner_config import SacConfig
from tests.agent.learning.learners import FLIGHTS, SAC, Flock, Kept, digest, parameters, same_again


def learner(seed: int = 0, config: SacConfig = SAC) -> SacLearner:
    return SacLearner(config, FLIGHTS, seed=seed)


@pytest.mark.slow
def test_the_same_seed_learns_the_same() -> None:
    digests = []
    for seed in (0, 0, 1):
        one: Learner = learner(seed)
        Flock().fly(one, 16)
        digests.append(digest(one))
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("at_once", [1, 5, 1000])
@pytest.mark.parametrize("steps", [10, 16, 23])
@pytest.mark.slow
def test_a_learner_restored_goes_on_to_the_bit(steps: int, at_once: int) -> None:
    """The memory holds 16 steps of two drones: it is not yet full, just full, and has begun anew."""
    straight, flock = learner(), Flock()
    flock.fly(straight, steps)
    kept, there = Kept(straight, flock.flown), digest(straight)
    flock_state = flock.snapshot()
    flock.fly(straight, 14)

    restored = learner(seed=99)
    kept.put_into(restored, at_once)
    assert digest(restored) == there
    flock_state.fly(restored, 14)
    assert digest(restored) == digest(straight)


def test_a_state_is_a_copy_not_a_view() -> None:
    one, flock = learner(), Flock()
    flock.fly(one, 10)
    state = one.state()
    before = copy.deepcopy(state)
    flock.fly(one, 14)
    moments = [kept["optimizers"]["policy_optimizer"]["state"][0]["exp_avg"] for kept in (before, state, one.state())]
    assert torch.equal(moments[0], moments[1])
    assert not torch.equal(moments[0], moments[2])
    assert state["log_entropy_coefficient"] == before["log_entropy_coefficient"]


def test_updates_follow_transitions_once_there_is_a_batch() -> None:
    one = learner(config=replace(SAC, updates_per_step=1.5))
    updates = []
    for _ in range(8):
        one.observe(same_again([0.0, 0.0]))
        one.learn()
        updates.append(one.updates)
    # A batch of 8 is there after four steps of two drones; from then on, 1.5 updates for each transition.
    assert updates == [0, 0, 0, 0, 3, 6, 9, 12]


def test_what_was_learned_is_told_and_not_kept() -> None:
    one = learner()
    Flock().fly(one, 8)
    one.observe(same_again([0.0, 0.0]))
    statistics = one.learn()
    assert statistics["Loss / Critic loss"] >= 0.0
    assert statistics["Coefficient / Entropy coefficient"] > 0.0
    assert one.learn() == {}


@pytest.mark.parametrize(("terminated", "value"), [(True, -1.0), (False, -2.0)])
@pytest.mark.slow
def test_a_crash_is_worth_its_reward_and_a_truncation_what_would_have_come(terminated: bool, value: float) -> None:
    # A reward of -1 for ever at a discount of 0.5 is worth -2; entropy is made to count for nothing.
    config = replace(SAC, gamma=0.5, tau=0.5, initial_ent_coef=1e-6, learning_rate=1e-2, updates_per_step=1)
    one = learner(config=config)
    for _ in range(60):
        one.observe(same_again([-1.0, -1.0], terminated=terminated, truncated=not terminated))
        one.learn()
    critic = Critic(Features.space(), action_space(), config.hidden_sizes)
    critic.load_state_dict(parameters(one, "critic_1"))
    features = Features(FLIGHTS)(torch.from_numpy(same_again([0.0]).observations))
    with torch.no_grad():
        expected, _ = critic.act({"observations": features, "taken_actions": torch.zeros(1, 3)})
    assert expected.item() == pytest.approx(value, abs=0.1)


def test_the_best_is_the_same_each_time_and_exploring_is_not() -> None:
    one = learner()
    observations = same_again([0.0] * 50).observations
    best = one.act(observations, explore=False)
    assert np.array_equal(best, one.act(observations, explore=False))
    tried = one.act(observations, explore=True)
    assert not np.array_equal(tried, one.act(observations, explore=True))
    for actions in (best, tried):
        assert actions.dtype == np.float32
        assert np.abs(actions).max() <= 1.0


def test_looking_for_the_best_draws_nothing() -> None:
    one = learner()
    before = torch.get_rng_state()
    one.act(same_again([0.0]).observations, explore=False)
    assert torch.equal(torch.get_rng_state(), before)


def test_weights_make_another_learner_act_the_same() -> None:
    one, other = learner(0), learner(1)
    observations = same_again([0.0]).observations
    assert not np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))
    other.load_weights(one.weights())
    assert np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))


@pytest.mark.parametrize("damage", ["missing", "unknown", "shape"])
def test_weights_of_another_network_are_refused_whole(damage: str) -> None:
    one = learner()
    weights = learner(1).weights()
    name = "policy.net.0.weight"
    if damage == "missing":
        del weights[name]
    elif damage == "unknown":
        weights["policy.extra"] = np.zeros(3, np.float32)
    else:
        weights[name] = weights[name][:-1]
    before = digest(one)
    with pytest.raises(ArtifactDamaged, match=r"policy\."):
        one.load_weights(weights)
    assert digest(one) == before


def test_a_memory_smaller_than_a_batch_is_refused() -> None:
    with pytest.raises(InvalidConfig):
        learner(config=SacConfig(buffer_size=100, batch_size=256))
