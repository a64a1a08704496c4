"""Our steps against torch's own, from the same parameters and gradients."""

import copy
from collections.abc import Callable

import torch
from torch import nn
from torch.optim import Adam

from agent.learning.fused_adam import FusedAdam

STEPS = 7


class Pupil:
    """A network whose gradients are made up; the same ones each time."""

    def __init__(self) -> None:
        torch.manual_seed(0)
        self.net = nn.Sequential(nn.Linear(37, 19), nn.Linear(19, 1))
        self.optimizer = Adam(self.net.parameters(), lr=3e-3, fused=True)
        for parameter in self.net.parameters():
            parameter.grad = torch.zeros_like(parameter)

    def step(self, take: Callable[[], object], steps: int = STEPS) -> None:
        for _ in range(steps):
            for parameter in self.net.parameters():
                torch.randn(parameter.shape, out=parameter.grad)
            with torch.no_grad():
                take()

    @property
    def numbers(self) -> list[torch.Tensor]:
        states = self.optimizer.state_dict()["state"]
        return [*self.net.parameters(), *(value for state in states.values() for value in state.values())]


def by_torch(steps: int = STEPS) -> Pupil:
    pupil = Pupil()
    pupil.step(pupil.optimizer.step, steps)
    return pupil


def same(one: Pupil, other: Pupil) -> bool:
    return all(torch.equal(mine, theirs) for mine, theirs in zip(one.numbers, other.numbers, strict=True))


def test_its_steps_are_torchs_to_the_bit() -> None:
    pupil = Pupil()
    pupil.step(FusedAdam(pupil.optimizer).step)
    assert same(pupil, by_torch())


def test_a_learning_rate_that_was_set_holds_from_the_next_step_on() -> None:
    torchs = by_torch(3)
    torchs.optimizer.param_groups[0]["lr"] = 1e-4
    torchs.step(torchs.optimizer.step, 2)
    pupil = Pupil()
    adam = FusedAdam(pupil.optimizer)
    pupil.step(adam.step, 3)
    adam.learning_rate = 1e-4
    pupil.step(adam.step, 2)
    assert same(pupil, torchs)


def test_there_is_no_state_before_the_first_step() -> None:
    pupil = Pupil()
    FusedAdam(pupil.optimizer)
    assert not pupil.optimizer.state


def test_it_goes_on_from_a_state_that_was_restored() -> None:
    pupil = Pupil()
    pupil.step(FusedAdam(pupil.optimizer).step, 3)
    pupil.optimizer.load_state_dict(copy.deepcopy(pupil.optimizer.state_dict()))
    pupil.step(FusedAdam(pupil.optimizer).step, STEPS - 3)
    assert same(pupil, by_torch())


def test_torch_goes_on_from_where_it_stopped() -> None:
    pupil = Pupil()
    pupil.step(FusedAdam(pupil.optimizer).step, 3)
    pupil.step(pupil.optimizer.step, STEPS - 3)
    assert same(pupil, by_torch())


def test_a_state_made_in_inference_mode_can_be_changed_outside_of_it() -> None:
    pupil = Pupil()
    with torch.inference_mode():
        pupil.step(FusedAdam(pupil.optimizer).step, 3)
    pupil.step(pupil.optimizer.step, STEPS - 3)
    assert same(pupil, by_torch())
