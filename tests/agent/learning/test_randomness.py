import random

import numpy as np
import torch

from agent.learning.randomness import random_state, restore_random_state, seed_all


def draws() -> tuple[float, float, float, float]:
    return random.random(), random.gauss(0, 1), float(np.random.normal()), float(torch.randn(1))  # noqa: NPY002


def test_the_same_seed_gives_the_same_draws() -> None:
    seed_all(3)
    first = draws()
    seed_all(3)
    assert draws() == first
    seed_all(4)
    assert all(one != other for one, other in zip(draws(), first, strict=True))


def test_generators_go_on_from_where_they_were_kept() -> None:
    seed_all(3)
    draws()
    state = random_state()
    following = draws()
    draws()
    restore_random_state(state)
    assert draws() == following
