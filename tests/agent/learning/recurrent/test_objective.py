import math

import pytest
import torch
from torch import Tensor

from agent.learning.recurrent.objective import entropy, policy_loss, value_loss

HALVES = torch.log(torch.tensor([[0.5, 0.25, 0.25]]))
"""Logits of one policy."""


def surrogate(ratio: float, advantage: float) -> tuple[float, Tensor]:
    """Of one action of probability 0.5 that was drawn with 0.5 / ratio, and its gradient by the logits."""
    logits = HALVES.clone().requires_grad_()
    drawn_with = torch.tensor([math.log(0.5 / ratio)])
    loss = policy_loss(logits, torch.tensor([0]), drawn_with, torch.tensor([advantage]), clip_range=0.2)
    loss.surrogate.backward()
    assert loss.ratios.item() == pytest.approx(ratio)
    assert logits.grad is not None
    return loss.surrogate.item(), logits.grad


@pytest.mark.parametrize(
    ("ratio", "advantage", "expected"),
    [
        (1.0, 2.0, -2.0),
        (1.1, 2.0, -2.2),
        (1.5, 2.0, -2.4),  # no more to gain beyond 1.2
        (0.5, 2.0, -1.0),
        (0.5, -2.0, 1.6),  # nor below 0.8
        (1.5, -2.0, 3.0),
    ],
)
def test_the_surrogate_is_clipped_where_a_ratio_has_gone_far_enough(ratio, advantage, expected) -> None:
    loss, gradient = surrogate(ratio, advantage)
    assert loss == pytest.approx(expected)
    is_clipped = (ratio, advantage) in [(1.5, 2.0), (0.5, -2.0)]
    assert (gradient == 0.0).all() == is_clipped


def test_the_entropy_of_an_even_policy_is_the_logarithm_of_its_actions() -> None:
    assert entropy(torch.zeros(3, 8)).item() == pytest.approx(math.log(8))
    assert entropy(HALVES).item() == pytest.approx(1.5 * math.log(2))
    assert entropy(torch.tensor([[1e4, 0.0]])).item() == 0.0


def test_the_bonus_is_for_entropy() -> None:
    loss = policy_loss(HALVES, torch.tensor([0]), HALVES[:, 0], torch.tensor([2.0]), clip_range=0.2)
    assert loss.total(0.1).item() == pytest.approx(-2.0 - 0.1 * 1.5 * math.log(2))


def test_the_value_loss_is_the_mean_squared_error() -> None:
    assert value_loss(torch.tensor([1.0, 5.0]), torch.tensor([2.0, 2.0])).item() == 5.0
