import numpy as np
import pytest
import torch

from agent.environment.spaces import action_space
from agent.learning.features import Features
from agent.learning.learner import Transition
from agent.learning.networks import Value
from agent.learning.ppo import PpoLearner
from protocol.errors import InvalidConfig
from protocol.learner_config import PpoConfig
from tests.agent.learning.learners import DRONES, FLIGHTS, PPO, Flock, Kept, digest, parameters, same_again


def learner(seed: int = 0, config: PpoConfig = PPO) -> PpoLearner:
    return PpoLearner(config, FLIGHTS, seed=seed)


def values(one: PpoLearner, hidden: tuple[int, ...], observations: np.ndarray) -> np.ndarray:
    network = Value(Features.space(), action_space(), hidden)
    network.load_state_dict(parameters(one, "value"))
    with torch.no_grad():
        return network.act({"observations": Features(FLIGHTS)(torch.from_numpy(observations))})[0].numpy()[:, 0]


def test_the_same_seed_learns_the_same() -> None:
    digests = []
    for seed in (0, 0, 1):
        one = learner(seed)
        Flock().fly(one, 20)
        digests.append(digest(one))
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("steps", [6, 9])
def test_a_learner_restored_goes_on_to_the_bit_even_within_a_rollout(steps: int) -> None:
    straight, flock = learner(), Flock()
    flock.fly(straight, steps)
    kept, there = Kept(straight, flock.flown), digest(straight)
    flock_state = flock.snapshot()
    flock.fly(straight, 16)

    restored = learner(seed=99)
    kept.put_into(restored)
    assert digest(restored) == there
    flock_state.fly(restored, 16)
    assert digest(restored) == digest(straight)


def test_it_learns_once_a_rollout_is_whole() -> None:
    one, flock = learner(), Flock()
    flock.fly(one, PPO.n_steps)
    assert one.updates == 0
    flock.fly(one, 1)
    assert one.updates == PPO.n_epochs * PPO.minibatches
    flock.fly(one, PPO.n_steps)
    assert one.updates == 2 * PPO.n_epochs * PPO.minibatches


def test_what_was_learned_is_told_once() -> None:
    one = learner()
    Flock().fly(one, PPO.n_steps)
    assert "Loss / Value loss" in one.learn()
    assert one.learn() == {}


def test_returns_stop_at_the_end_of_a_flight() -> None:
    """Hand-made rollout: flights end at step 2, of drone 0 by time and of drone 1 by a crash."""
    config = PpoConfig(hidden_sizes=(16,), n_steps=4, n_epochs=1, minibatches=1, gamma=0.5, gae_lambda=1.0)
    one = learner(config=config)
    rng = np.random.default_rng(0)
    observations = rng.normal(size=(5, DRONES, 111)).astype(np.float32)
    final = rng.normal(size=(DRONES, 111)).astype(np.float32)
    rewards = np.array([[1.0, 1.0], [2.0, 2.0], [4.0, 4.0], [8.0, 8.0]])
    for step in range(4):
        ends = step == 1
        actions = one.act(observations[step], explore=True)
        one.observe(
            Transition(
                observations=observations[step],
                actions=actions,
                rewards=rewards[step],
                next_observations=final if ends else observations[step + 1],
                terminated=np.array([False, ends]),
                truncated=np.array([ends, False]),
            )
        )
    last, (cut, _) = values(one, config.hidden_sizes, observations[4]), values(one, config.hidden_sizes, final)
    one.learn()
    returns = one.state()["rollout"]["returns"][:, :, 0].numpy()
    # With λ = 1 a return is the discounted sum of rewards up to the end of its flight and of the value that is there.
    tail = [[4 + 0.5 * (8 + 0.5 * value), 8 + 0.5 * value] for value in last]
    truncated = [1 + 0.5 * (2 + 0.5 * cut), 2 + 0.5 * cut]
    crashed = [1 + 0.5 * 2, 2]
    assert returns[:, 0] == pytest.approx([*truncated, *tail[0]], abs=1e-4)
    assert returns[:, 1] == pytest.approx([*crashed, *tail[1]], abs=1e-4)


@pytest.mark.slow
def test_it_learns_what_pays() -> None:
    """Rewards for flying up, whatever is seen: the mean velocity turns upwards."""
    config = PpoConfig(hidden_sizes=(16,), n_steps=32, n_epochs=8, minibatches=2, gamma=0.0, learning_rate=1e-2)
    one = learner(config=config)
    observations = same_again([0.0, 0.0]).observations
    before = one.act(observations, explore=False)[0, 2]
    for _ in range(10 * config.n_steps):
        actions = one.act(observations, explore=True)
        one.learn()
        step = same_again(actions[:, 2].tolist())
        one.observe(
            Transition(
                observations=observations,
                actions=actions,
                rewards=step.rewards,
                next_observations=observations,
                terminated=step.terminated,
                truncated=step.truncated,
            )
        )
    assert one.act(observations, explore=False)[0, 2] > before + 0.5


def test_weights_make_another_learner_act_the_same() -> None:
    one, other = learner(0), learner(1)
    observations = same_again([0.0]).observations
    assert not np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))
    other.load_weights(one.weights())
    assert np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))


def test_looking_for_the_best_leaves_the_step_under_way_alone() -> None:
    one = learner()
    one.act(same_again([0.0, 0.0]).observations, explore=True)
    before = digest(one)
    one.act(same_again([0.0] * 5).observations, explore=False)
    assert digest(one) == before


def test_a_rollout_too_short_for_its_minibatches_is_refused() -> None:
    with pytest.raises(InvalidConfig):
        learner(config=PpoConfig(n_steps=1, minibatches=4))
