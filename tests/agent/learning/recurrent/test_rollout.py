import pytest
import torch
from torch import Tensor

from agent.learning.recurrent.network import RecurrentNetwork
from agent.learning.recurrent.rollout import Rollout, Steps, advantages, worth
from protocol.learner_config import RecurrentPpoConfig

STEPS, DRONES = 4, 3


def column(*values: float) -> Tensor:
    return torch.tensor(values, dtype=torch.float64)[:, None]


def test_advantages_are_discounted_sums_of_surprises() -> None:
    """γ = 0.5 and λ = 0.5: a quarter of the next step's comes back."""
    rewards, before, after = column(1, 2, 4), column(2, 4, 8), column(4, 8, 16)
    over = torch.zeros(3, 1, dtype=torch.bool)
    # Surprises: 1 + 2 - 2 = 1; 2 + 4 - 4 = 2; 4 + 8 - 8 = 4.
    estimates = advantages(rewards, before, after, over, gamma=0.5, gae_lambda=0.5)
    assert estimates[:, 0].tolist() == [1 + 0.25 * (2 + 0.25 * 4), 2 + 0.25 * 4, 4.0]


@pytest.mark.parametrize(("worth_after", "first"), [(0.0, 1 + 0.5 * 4 - 2), (6.0, 1 + 0.5 * 4 - 2)])
def test_nothing_comes_back_over_the_end_of_an_episode(worth_after: float, first: float) -> None:
    """It ends with the second step, by termination (worth nothing) or by truncation (worth 6)."""
    rewards, before, after = column(1, 2, 100), column(2, 4, 8), column(4, worth_after, 16)
    over = torch.tensor([[False], [True], [False]])
    estimates = advantages(rewards, before, after, over, gamma=0.5, gae_lambda=0.5)
    second = 2 + 0.5 * worth_after - 4
    assert estimates[:, 0].tolist() == [first + 0.25 * second, second, 100.0]


def test_with_lambda_one_a_return_is_the_discounted_sum_of_rewards() -> None:
    rewards, before, after = column(1, 2, 4), column(7, -3, 5), column(-3, 5, 10)
    over = torch.zeros(3, 1, dtype=torch.bool)
    returns = advantages(rewards, before, after, over, gamma=0.5, gae_lambda=1.0) + before
    assert returns[0].item() == pytest.approx(1 + 0.5 * (2 + 0.5 * (4 + 0.5 * 10)))


def some_steps() -> Steps:
    """Of three drones. Drone 0's episode is truncated with step 1, drone 1's terminates with it, drone 2's goes on."""
    torch.manual_seed(1)
    observations = torch.rand(STEPS + 1, DRONES, 20)
    final = torch.rand(DRONES, 20)
    next_observations = observations[1:].clone()
    next_observations[1, :2] = final[:2]
    ends = torch.zeros(STEPS, DRONES, dtype=torch.bool)
    truncated, terminated, starts = ends.clone(), ends.clone(), ends.clone()
    truncated[1, 0] = terminated[1, 1] = starts[2, 0] = starts[2, 1] = True
    return Steps(
        observations=observations[:-1],
        starts=starts,
        actions=torch.zeros(STEPS, DRONES, dtype=torch.int64),
        log_probs=torch.zeros(STEPS, DRONES),
        rewards=torch.zeros(STEPS, DRONES),
        next_observations=next_observations,
        terminated=terminated,
        truncated=truncated,
    )


def critic() -> RecurrentNetwork:
    torch.manual_seed(0)
    return RecurrentNetwork(RecurrentPpoConfig(lstm_hidden_size=8, hidden_size=8), 1, head_gain=1.0)


@torch.no_grad()
def value(one: RecurrentNetwork, observations: list[Tensor], state: Tensor) -> float:
    """Of the last of several observations of an episode of one drone."""
    rows = torch.stack(observations)[:, None]
    return one.run(rows, torch.zeros(len(rows), 1, dtype=torch.bool), state).outputs[-1, 0, 0].item()


def test_a_truncated_step_is_worth_its_own_last_observation_by_its_own_episode() -> None:
    one, steps = critic(), some_steps()
    state = torch.randn_like(one.start(DRONES))
    with torch.no_grad():
        valued = worth(one, steps, state)
    episode = [steps.observations[0, 0], steps.observations[1, 0], steps.next_observations[1, 0]]
    assert valued.after[1, 0].item() == pytest.approx(value(one, episode, state[:, :, :1]), abs=1e-6)
    assert valued.after[1, 0] != valued.before[2, 0]


def test_a_terminated_step_is_worth_nothing_more() -> None:
    one = critic()
    with torch.no_grad():
        valued = worth(one, some_steps(), one.start(DRONES))
    assert valued.after[1, 1].item() == 0.0
    assert torch.equal(valued.after[0], valued.before[1])


def test_the_last_step_is_worth_what_comes_after_the_rollout() -> None:
    one, steps = critic(), some_steps()
    state = torch.randn_like(one.start(DRONES))
    with torch.no_grad():
        valued = worth(one, steps, state)
        following = one.run(steps.next_observations[-1:], torch.zeros(1, DRONES, dtype=torch.bool), valued.state)
    assert valued.after[-1].numpy() == pytest.approx(following.outputs[0, :, 0].numpy(), abs=1e-6)
    whole = [*steps.observations[:, 2], steps.next_observations[-1, 2]]
    assert valued.after[-1, 2].item() == pytest.approx(value(one, whole, state[:, :, 2:]), abs=1e-6)


def test_a_truncation_with_the_last_step_is_one_and_termination_counts_more() -> None:
    one, steps = critic(), some_steps()
    steps.truncated[-1, :2] = True
    steps.terminated[-1, 1] = True
    with torch.no_grad():
        valued = worth(one, steps, one.start(DRONES))
    assert valued.after[-1, 0] != 0.0
    assert valued.after[-1, 1] == 0.0


def test_a_minibatch_has_all_steps_of_its_drones_and_their_states() -> None:
    numbers = torch.arange(STEPS * DRONES, dtype=torch.float32).view(STEPS, DRONES)
    steps = Steps(**(some_steps().as_dict() | {"rewards": numbers}))
    states = torch.arange(2.0 * 2 * DRONES * 5).view(2, 2, DRONES, 5)
    rollout = Rollout(steps=steps, actor_state=states, critic_state=-states, advantages=numbers, returns=-numbers)
    part = rollout.of_drones(torch.tensor([2, 0]))
    assert torch.equal(part.steps.rewards, numbers[:, [2, 0]])
    assert torch.equal(part.steps.observations, steps.observations[:, [2, 0]])
    assert torch.equal(part.actor_state, states[:, :, [2, 0]])
    assert torch.equal(part.critic_state, -states[:, :, [2, 0]])
    assert torch.equal(part.advantages, -part.returns)
