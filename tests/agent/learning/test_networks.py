import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.distributions import Normal, TanhTransform, TransformedDistribution

from agent.environment.spaces import action_space
from agent.learning.features import FEATURE_SIZE, Features, to_world_frame
from agent.learning.networks import Critic, GaussianPolicy, SquashedPolicy, Value, layers, log_squashing

SPACES = (Features.space(), action_space())


@pytest.fixture
def inputs() -> dict[str, torch.Tensor]:
    torch.manual_seed(0)
    features = torch.randn(64, FEATURE_SIZE)
    features[:, :2] /= features[:, :2].norm(dim=1, keepdim=True)
    return {"observations": features}


@given(value=st.floats(-4.0, 4.0))
def test_the_log_of_tanhs_derivative(value: float) -> None:
    found = log_squashing(torch.tensor(value, dtype=torch.float64))
    assert found.item() == pytest.approx(math.log(1.0 - math.tanh(value) ** 2), abs=1e-9)


def test_the_log_of_tanhs_derivative_holds_where_tanh_is_one() -> None:
    # 1 - tanh² x goes like 4 exp(-2x), far below what a float32 near 1 can tell.
    assert log_squashing(torch.tensor(50.0)).item() == pytest.approx(math.log(4.0) - 100.0)


def test_the_log_probability_is_that_of_the_squashed_velocity(inputs) -> None:
    policy = SquashedPolicy(*SPACES, (32, 32)).double()
    inputs = {"observations": inputs["observations"].double()}
    with torch.no_grad():
        actions, outputs = policy.act(inputs)
        mean, about = policy.compute(inputs)
        squashed = TransformedDistribution(Normal(mean, about["log_std"].exp()), [TanhTransform()])
        expected = squashed.log_prob(actions).sum(1, keepdim=True)
    assert outputs["log_prob"].numpy() == pytest.approx(expected.numpy(), abs=1e-6)


def test_velocities_are_within_their_limits_and_scatter_around_the_best(inputs) -> None:
    policy = SquashedPolicy(*SPACES, (32, 32))
    with torch.no_grad():
        many = {"observations": inputs["observations"][:1].repeat(4000, 1)}
        actions, outputs = policy.act(many)
    assert actions.abs().max() <= 1.0
    assert actions.median(dim=0).values.numpy() == pytest.approx(outputs["mean_actions"][0].numpy(), abs=0.06)


@pytest.mark.parametrize("drones", [1, 2, 4])
def test_velocities_are_chosen_to_the_bit_as_the_policy_computes_them(inputs, drones: int) -> None:
    policy = SquashedPolicy(*SPACES, (32, 32))
    features = inputs["observations"][:drones]
    with torch.no_grad():
        mean, outputs = policy.compute({"observations": features})
        best = torch.tanh(mean)
        torch.manual_seed(1)
        drawn = torch.tanh(mean + outputs["log_std"].exp() * torch.randn_like(mean))
    assert np.array_equal(policy.velocities(features.numpy(), explore=False), best.numpy())
    torch.manual_seed(1)
    assert np.array_equal(policy.velocities(features.numpy(), explore=True), drawn.numpy())


def test_a_policy_flies_the_same_way_at_every_bearing(inputs) -> None:
    policy = SquashedPolicy(*SPACES, (32,))
    # Weights of the bearing itself and of the place, which alone tell one bearing from another, are taken out.
    with torch.no_grad():
        policy.net[0].weight[:, [0, 1, 4, 5]] = 0.0
        features = inputs["observations"][:1].repeat(2, 1)
        features[0, :2], features[1, :2] = torch.tensor([1.0, 0.0]), torch.tensor([0.0, 1.0])
        ahead, turned = policy.compute({"observations": features})[0]
    quarter = to_world_frame(ahead[None], torch.tensor([[0.0, 1.0]]))[0]
    assert turned.numpy() == pytest.approx(quarter.numpy(), abs=1e-6)


def test_critics_and_values_give_a_number_each(inputs) -> None:
    actions = torch.zeros(64, 3)
    assert Critic(*SPACES, (16,)).act({**inputs, "taken_actions": actions})[0].shape == (64, 1)
    assert Value(*SPACES, (16,)).act(inputs)[0].shape == (64, 1)


def test_a_gaussian_policy_knows_the_probability_of_what_was_flown(inputs) -> None:
    policy = GaussianPolicy(*SPACES, (16,))
    with torch.no_grad():
        actions, drawn = policy.act(inputs)
        _, asked = policy.act({**inputs, "taken_actions": actions})
    assert asked["log_prob"].numpy() == pytest.approx(drawn["log_prob"].numpy(), abs=1e-5)


def test_layers_are_as_wide_as_asked() -> None:
    sizes = [tuple(layer.weight.shape) for layer in layers(5, (7, 3), 2) if isinstance(layer, torch.nn.Linear)]
    assert sizes == [(7, 5), (3, 7), (2, 3)]
