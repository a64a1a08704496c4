import pytest
import torch
from msgspec.structs import replace
from torch import Tensor

from agent.learning.recurrent.encoding import encoded
from agent.learning.recurrent.network import RecurrentNetwork, Sequence
from protocol.learner_config import RecurrentPpoConfig

CONFIG = RecurrentPpoConfig(lstm_hidden_size=12, hidden_size=7)
STEPS, DRONES = 6, 5


def network(dtype: torch.dtype = torch.float64, seed: int = 0, layers: int = 2) -> RecurrentNetwork:
    torch.manual_seed(seed)
    config = RecurrentPpoConfig(lstm_hidden_size=12, hidden_size=7, n_lstm_layers=layers)
    return RecurrentNetwork(config, 3, head_gain=1.0).to(dtype)


def some_observations(dtype: torch.dtype = torch.float64) -> Tensor:
    torch.manual_seed(1)
    return torch.cat([torch.randint(-9, 10, (STEPS, DRONES, 2)), torch.rand(STEPS, DRONES, 18)], dim=2).to(dtype)


def some_starts() -> Tensor:
    starts = torch.zeros(STEPS, DRONES, dtype=torch.bool)
    starts[0, 0] = starts[2, 1] = starts[3, 1] = starts[5, 4] = True
    return starts


def some_state(one: RecurrentNetwork) -> Tensor:
    return torch.randn_like(one.start(DRONES))


@torch.no_grad()
def run(one: RecurrentNetwork, observations: Tensor, starts: Tensor, state: Tensor) -> Sequence:
    return one.run(observations, starts, state)


def by_autograd(one: RecurrentNetwork, observations: Tensor, starts: Tensor, state: Tensor) -> Tensor:
    """The outputs by torch's own modules, step by step."""
    outputs = []
    for rows, begins in zip(observations, starts, strict=True):
        hidden, cells = state * ~begins[:, None]
        output, state = one.lstm(encoded(rows)[None], (hidden, cells))
        state = torch.stack(state)
        outputs.append(one.head(torch.tanh(one.hidden(output[0]))))
    return torch.stack(outputs)


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_outputs_and_gradients_are_those_of_torchs_modules(layers: int) -> None:
    one, twin = network(layers=layers), network(layers=layers)
    state, gradient = some_state(one), torch.randn(STEPS, DRONES, 3, dtype=torch.float64)
    expected = by_autograd(twin, some_observations(), some_starts(), state)
    for parameter in twin.parameters():
        parameter.grad = None
    expected.backward(gradient)
    sequence = run(one, some_observations(), some_starts(), state)
    assert torch.allclose(sequence.outputs, expected, atol=1e-12)
    with torch.no_grad():
        one.backpropagate(sequence, gradient)
    for (name, ours), theirs in zip(one.named_parameters(), twin.parameters(), strict=True):
        assert ours.grad is not None
        assert torch.allclose(ours.grad, theirs.grad, atol=1e-12), name


def test_at_the_thesiss_size_gradients_are_autograds_but_for_rounding() -> None:
    torch.manual_seed(0)
    one = RecurrentNetwork(RecurrentPpoConfig(), 8, head_gain=1.0)
    state = some_state(one)
    observations, gradient = some_observations(torch.float32), torch.randn(STEPS, DRONES, 8)
    sequence = run(one, observations, some_starts(), state)
    with torch.no_grad():
        one.backpropagate(sequence, gradient)
    ours = [parameter.grad.clone() for parameter in one.parameters()]
    for parameter in one.parameters():
        parameter.grad = None
    by_autograd(one, observations, some_starts(), state).backward(gradient)
    for mine, parameter in zip(ours, one.parameters(), strict=True):
        assert (mine - parameter.grad).abs().max() < 1e-5 * parameter.grad.abs().max()


def test_a_sequence_is_its_steps_one_after_the_other() -> None:
    one = network()
    observations, starts, state = some_observations(), some_starts(), some_state(one)
    whole = run(one, observations, starts, state)
    for step in range(STEPS):
        alone = run(one, observations[step : step + 1], starts[step : step + 1], state)
        state = alone.last_state
        assert torch.allclose(alone.outputs[0], whole.outputs[step], atol=1e-12)
    assert torch.allclose(state, whole.last_state, atol=1e-12)


def test_the_state_after_a_step_is_the_one_to_go_on_from() -> None:
    one = network()
    observations, starts, state = some_observations(), some_starts(), some_state(one)
    whole = run(one, observations, starts, state)
    steps, drones = torch.tensor([0, 3, 4]), torch.tensor([2, 0, 1])
    following = run(
        one, observations[steps + 1, drones][None], starts[steps + 1, drones][None], whole.states_after(steps, drones)
    )
    assert torch.allclose(following.outputs[0], whole.outputs[steps + 1, drones], atol=1e-12)


def test_nothing_is_remembered_over_the_end_of_an_episode() -> None:
    one = network()
    observations, starts, state = some_observations(), some_starts(), some_state(one)
    before = run(one, observations, starts, state).outputs
    observations[:3, 1] += 1.0
    state[:, :, 1] += 1.0
    after = run(one, observations, starts, state).outputs
    # Drone 1's episodes start with steps 2 and 3.
    assert (before[:3, 1] != after[:3, 1]).any(1).all()
    assert torch.equal(before[3:, 1], after[3:, 1])
    others = [0, 2, 3, 4]
    assert torch.equal(before[:, others], after[:, others])


def test_without_memory_a_step_depends_on_its_observation_alone() -> None:
    torch.manual_seed(0)
    one = RecurrentNetwork(replace(CONFIG, memory=False), 3, head_gain=1.0).double()
    seen = some_observations()
    together = run(one, seen, some_starts(), some_state(one)).outputs
    alone = torch.cat([run(one, rows[None], some_starts()[:1], some_state(one)).outputs for rows in seen])
    assert torch.allclose(together, alone, atol=1e-12)


def test_an_actors_first_policy_is_all_but_even() -> None:
    torch.manual_seed(0)
    actor = RecurrentNetwork(CONFIG, 8, head_gain=0.01)
    outputs = run(actor, some_observations(torch.float32), some_starts(), actor.start(DRONES)).outputs
    assert (outputs.softmax(2) - 1 / 8).abs().max() < 0.01
