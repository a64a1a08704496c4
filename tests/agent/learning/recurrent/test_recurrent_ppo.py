import copy
from itertools import pairwise

import numpy as np
import pytest
import torch
from msgspec.structs import replace

from agent.learning.learner import Learner
from agent.learning.recurrent.recurrent_ppo import RecurrentPpoLearner
from protocol.errors import ArtifactDamaged, InvalidConfig, InvalidInput
from protocol.learner_config import RecurrentPpoConfig
from tests.agent.learning.learners import Kept, digest
from tests.agent.learning.recurrent.recall_task import DRONES, SMALL, RecallTask

DEVIATION = "Policy / Largest deviation of a ratio from 1 before the updates"


def learner(seed: int = 0, config: RecurrentPpoConfig = SMALL, drones: int = DRONES) -> RecurrentPpoLearner:
    return RecurrentPpoLearner(config, drones, seed=seed)


def test_the_same_seed_learns_the_same() -> None:
    digests = []
    for seed in (0, 0, 1):
        one: Learner = learner(seed)
        RecallTask().run(one, 20)
        digests.append(digest(one))
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("learns_first", [True, False])
@pytest.mark.parametrize("steps", [6, 9, 12])
def test_a_learner_restored_goes_on_to_the_bit_even_within_a_rollout(steps: int, learns_first: bool) -> None:
    straight, task = learner(), RecallTask()
    task.run(straight, steps, learns_first=learns_first)
    kept, there = Kept(straight, task.taken), digest(straight)
    other_task = task.snapshot()
    task.run(straight, 16, learns_first=learns_first)

    restored = learner(seed=99)
    kept.put_into(restored)
    assert digest(restored) == there
    other_task.run(restored, 16, learns_first=learns_first)
    assert digest(restored) == digest(straight)


def test_a_learner_restored_with_an_action_under_way_goes_on_to_the_bit() -> None:
    straight, task = learner(), RecallTask()
    task.run(straight, SMALL.n_steps)
    actions = task.act(straight)
    kept, there = Kept(straight, task.taken), digest(straight)
    other_task = task.snapshot()
    go_on(straight, task, actions)

    restored = learner(seed=99)
    kept.put_into(restored)
    assert digest(restored) == there
    go_on(restored, other_task, actions)
    assert digest(restored) == digest(straight)


def go_on(one: RecurrentPpoLearner, task: RecallTask, actions: np.ndarray) -> None:
    """From actions that are under way."""
    one.learn()
    one.observe(task.step(actions))
    task.run(one, 8)


def test_a_state_is_a_copy_not_a_view() -> None:
    one, task = learner(), RecallTask()
    task.run(one, 9)
    state = one.state()
    before = copy.deepcopy(state)
    task.run(one, 9)
    moments = [kept["optimizer"]["state"][0]["exp_avg"] for kept in (before, state, one.state())]
    assert torch.equal(moments[0], moments[1])
    assert not torch.equal(moments[0], moments[2])
    assert torch.equal(before["policy_state"], state["policy_state"])


def test_it_learns_once_a_rollout_is_whole() -> None:
    one, task = learner(), RecallTask()
    task.run(one, SMALL.n_steps)
    assert one.updates == 0
    task.run(one, 1)
    assert one.updates == SMALL.n_epochs * SMALL.minibatches
    task.run(one, SMALL.n_steps)
    assert one.updates == 2 * SMALL.n_epochs * SMALL.minibatches


def test_what_was_learned_is_told_once() -> None:
    one = learner()
    RecallTask().run(one, SMALL.n_steps)
    statistics = one.learn()
    assert statistics["Loss / Value loss"] > 0.0
    assert statistics["Policy / Entropy"] == pytest.approx(np.log(8), abs=0.01)
    assert one.learn() == {}


def with_larger_weights(one: RecurrentPpoLearner) -> None:
    """Three times as large, so that what the networks remember makes a difference to all that they say."""
    weights = {name: 3.0 * weight for name, weight in one.weights().items()}
    weights["actor.head.weight"] *= 100.0
    one.load_weights(weights)


def test_ratios_are_one_before_the_first_update() -> None:
    """So the hidden states are those that the steps were drawn with."""
    one, task = learner(config=replace(SMALL, minibatches=1)), RecallTask()
    with_larger_weights(one)
    for _ in range(4):
        task.run(one, SMALL.n_steps)
        statistics = one.learn()
        assert statistics[DEVIATION] < 1e-4
    assert 0.1 < statistics["Policy / Entropy"] < 1.9


def test_a_hidden_state_one_step_late_would_be_seen_in_the_ratios() -> None:
    one, task = learner(config=replace(SMALL, minibatches=1)), RecallTask()
    with_larger_weights(one)
    task.run(one, SMALL.n_steps + 2)
    late = one.state()["policy_state"]
    task.run(one, SMALL.n_steps - 2)
    one.restore(one.state() | {"actor_state": late})
    assert one.learn()[DEVIATION] > 1e-2


def test_an_action_under_way_keeps_its_probability_and_the_steps_after_it_are_of_the_new_policy() -> None:
    config = replace(SMALL, minibatches=1, n_epochs=4, learning_rate=1e-2)
    one, task = learner(config=config), RecallTask()
    with_larger_weights(one)
    task.run(one, SMALL.n_steps)
    actions = task.act(one)
    before = one.state()["under_way"]
    one.learn()
    assert torch.equal(one.state()["under_way"]["log_probs"], before["log_probs"])
    one.observe(task.step(actions))
    task.run(one, SMALL.n_steps - 1)
    ratios = ratios_of_rollout(one)
    assert (ratios[0] - 1.0).abs().max() > 1e-2
    assert (ratios[1:] - 1.0).abs().max() < 1e-4


def ratios_of_rollout(one: RecurrentPpoLearner) -> torch.Tensor:
    """(t, n) of the steps that it will learn from, by its weights."""
    state = one.state()
    steps = {name: torch.stack([step[name] for step in state["steps"]]) for name in state["steps"][0]}
    with torch.no_grad():
        logits = one._actor.run(steps["observations"], steps["starts"], state["actor_state"]).outputs
    log_probs = logits.log_softmax(2).gather(2, steps["actions"][..., None])[..., 0]
    return (log_probs - steps["log_probs"]).exp()


@pytest.mark.parametrize("learns_first", [True, False])
@pytest.mark.slow
def test_it_learns_what_only_memory_can_tell(learns_first: bool) -> None:
    """Without it, one of two cues is guessed at the end, and half of the episodes pay at best."""
    config = RecurrentPpoConfig(
        lstm_hidden_size=32,
        hidden_size=16,
        n_steps=16,
        learning_rate=3e-3,
        gamma=0.9,
        ent_coef=0.01,
        reward_scale=1.0,
    )
    one, task = learner(config=config, drones=32), RecallTask(32)
    task.run(one, 1250, learns_first=learns_first)
    assert np.mean(task.paid[-400:]) > 0.8


@pytest.mark.parametrize(
    ("setting", "changes"),
    [
        ("Coefficient / Entropy coefficient", {"ent_coef": 0.3, "final_ent_coef": 0.1, "ent_coef_steps": 48}),
        (
            "Learning / Learning rate",
            {"learning_rate": 0.3, "final_learning_rate": 0.1, "learning_rate_steps": 48},
        ),
    ],
)
def test_a_setting_falls_with_the_environments_steps(setting: str, changes: dict[str, float]) -> None:
    # A rollout is 24 steps of four drones.
    config = replace(SMALL, **changes)
    one, task = learner(config=config), RecallTask()
    told = []
    for _ in range(3):
        task.run(one, config.n_steps)
        told.append(one.learn()[setting])
    assert told == pytest.approx([0.2, 0.1, 0.1])


def test_nothing_is_learned_once_the_learning_rate_is_zero() -> None:
    # Learning begins once a rollout is whole: after its steps, so these are the last that change anything.
    config = replace(SMALL, final_learning_rate=0.0, learning_rate_steps=48)
    one, task = learner(config=config), RecallTask()
    weights = [one.weights()]
    for _ in range(3):
        task.run(one, config.n_steps)
        one.learn()
        weights.append(one.weights())
    changed = [
        any(not np.array_equal(before[name], after[name]) for name in before) for before, after in pairwise(weights)
    ]
    assert changed == [True, False, False]


def test_the_best_is_the_same_each_time_and_exploring_is_not() -> None:
    one, task = learner(drones=60), RecallTask(60)
    best = one.act(task.observations, explore=False)
    assert np.array_equal(best, one.act(task.observations, explore=False))
    tried = one.act(task.observations, explore=True)
    assert not np.array_equal(tried, one.act(task.observations, explore=True))
    for actions in (best, tried):
        assert actions.dtype == np.int64
        assert set(actions.tolist()) <= set(range(8))


def test_looking_for_the_best_leaves_the_step_under_way_alone() -> None:
    one, task = learner(), RecallTask()
    task.run(one, 3)
    task.act(one)
    before = digest(one)
    one.act(task.observations, explore=False)
    assert digest(one) == before


def test_actions_are_the_callers_own() -> None:
    one, task = learner(), RecallTask()
    actions = task.act(one)
    step = task.step(actions.copy())
    actions[:] = 7
    one.observe(step)
    assert torch.equal(one.state()["steps"][0]["actions"], torch.from_numpy(step.actions))


def test_rewards_are_learned_scaled() -> None:
    one, task = learner(config=replace(SMALL, reward_scale=0.1)), RecallTask()
    step = replace(task.step(task.act(one)), rewards=np.array([1.0, -2.0, 0.0, 10.0]))
    one.observe(step)
    assert one.state()["steps"][0]["rewards"].numpy() == pytest.approx([0.1, -0.2, 0.0, 1.0])


def test_weights_make_another_learner_act_the_same() -> None:
    one, other, task = learner(0, drones=60), learner(1, drones=60), RecallTask(60)
    observations = task.observations
    assert not np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))
    other.load_weights(one.weights())
    assert np.array_equal(one.act(observations, explore=False), other.act(observations, explore=False))


def test_weights_of_another_network_are_refused_whole() -> None:
    one = learner()
    weights = learner(1).weights()
    weights["critic.head.bias"] = np.zeros(2, np.float32)
    before = digest(one)
    with pytest.raises(ArtifactDamaged, match=r"critic\.head\.bias"):
        one.load_weights(weights)
    assert digest(one) == before


def test_a_step_of_another_policy_is_refused() -> None:
    one, task = learner(), RecallTask()
    step = task.step(np.zeros(DRONES, np.int64))
    with pytest.raises(InvalidInput):
        one.observe(step)


def test_drones_that_make_no_equal_minibatches_are_refused() -> None:
    with pytest.raises(InvalidConfig):
        learner(drones=3)
