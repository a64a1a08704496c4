import numpy as np
import pytest
import torch

from agent.learning.recurrent.policy import RecurrentPolicy, drawn, log_prob, new_actor
from agent.learning.recurrent.recurrent_ppo import RecurrentPpoLearner
from protocol.errors import ArtifactDamaged
from tests.agent.learning.recurrent.recall_task import SMALL, RecallTask

NO_STARTS = np.zeros(3, np.bool_)


def policy(seed: int = 0) -> RecurrentPolicy:
    torch.manual_seed(seed)
    actor = new_actor(SMALL)
    # Far from even, so that what is remembered makes a difference.
    with torch.no_grad():
        for parameter in actor.parameters():
            parameter.mul_(3.0)
        actor.head.weight.mul_(100.0)
    one = RecurrentPolicy(actor)
    one.start(3)
    return one


def some_observations(steps: int, drones: int = 3) -> np.ndarray:
    return np.random.default_rng(0).random((steps, drones, 20), dtype=np.float32)


def logits(one: RecurrentPolicy, observations: np.ndarray, starts: np.ndarray = NO_STARTS) -> np.ndarray:
    return one.step(torch.from_numpy(observations), torch.from_numpy(starts)).numpy()


def test_it_remembers_its_episode_and_forgets_it_where_the_next_starts() -> None:
    one, fresh = policy(), policy()
    first, second = some_observations(2)
    logits(one, first)
    remembering = logits(one, second, np.array([False, True, False]))
    forgetting = logits(fresh, second)
    assert np.array_equal(remembering[1], forgetting[1])
    assert (np.abs(remembering - forgetting)[[0, 2]].max(axis=1) > 1e-3).all()


def test_start_forgets_all_drones() -> None:
    one = policy()
    first, second = some_observations(2)
    logits(one, first)
    one.start(3)
    assert np.array_equal(logits(one, second), logits(policy(), second))


def test_some_drones_go_on_without_the_others() -> None:
    one = policy()
    first, second = some_observations(2)
    logits(one, first)
    together = logits(one.copy(), second)
    one.keep(np.array([2, 0]))
    apart = logits(one, second[[2, 0]], NO_STARTS[:2])
    assert apart == pytest.approx(together[[2, 0]], abs=1e-5)


def test_a_copy_remembers_on_its_own() -> None:
    one = policy()
    first, second = some_observations(2)
    logits(one.copy(), first)
    assert np.array_equal(logits(one, second), logits(policy(), second))


def test_without_exploring_it_takes_the_most_probable_action_and_draws_nothing() -> None:
    observations = some_observations(1)[0]
    before = torch.get_rng_state()
    actions = policy().act(observations, explore=False)
    assert torch.equal(torch.get_rng_state(), before)
    assert actions.dtype == np.int64
    assert actions.tolist() == logits(policy(), observations).argmax(axis=1).tolist()


def test_exploring_draws_actions_by_their_probabilities() -> None:
    probabilities = torch.tensor([0.5, 0.3, 0.2, 0.0])
    torch.manual_seed(0)
    counts = torch.bincount(drawn(probabilities.log().expand(10_000, 4)), minlength=4)
    assert (counts / 10_000).numpy() == pytest.approx(probabilities.numpy(), abs=0.02)
    assert counts[3] == 0


def test_a_generator_of_its_own_draws_the_same_again() -> None:
    observations = some_observations(1, drones=200)[0]
    draws = []
    for seed in (5, 5, 6):
        one = policy()
        one.start(200)
        draws.append(one.act(observations, explore=True, generator=torch.Generator().manual_seed(seed)).tolist())
    assert draws[0] == draws[1] != draws[2]


def test_the_log_probability_is_that_of_the_action() -> None:
    policies = torch.tensor([[0.5, 0.25, 0.25], [0.1, 0.2, 0.7]])
    chances = log_prob(policies.log() + 3.0, torch.tensor([0, 2])).exp()
    assert chances.numpy() == pytest.approx([0.5, 0.7])


def test_a_learners_weights_are_enough_to_act_as_it_does() -> None:
    learner, task = RecurrentPpoLearner(SMALL, 4, seed=0), RecallTask()
    task.run(learner, 13)
    learner.learn()
    one = RecurrentPolicy.of_weights(learner.weights(), SMALL)
    one.start(4)
    # A learner that has taken no step is at the start of every episode.
    fresh = RecurrentPpoLearner(SMALL, 4, seed=5)
    fresh.load_weights(learner.weights())
    assert np.array_equal(one.act(task.observations, explore=False), fresh.act(task.observations, explore=False))


@pytest.mark.parametrize("damage", ["missing", "shape"])
def test_weights_of_another_network_are_refused(damage: str) -> None:
    weights = RecurrentPpoLearner(SMALL, 4, seed=0).weights()
    name = "actor.lstm.weight_hh_l1"
    if damage == "missing":
        del weights[name]
    else:
        weights[name] = weights[name][:-1]
    with pytest.raises(ArtifactDamaged, match="weight_hh_l1"):
        RecurrentPolicy.of_weights(weights, SMALL)
