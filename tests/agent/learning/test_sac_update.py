"""Our update against skrl's own, from the same networks, transitions and random numbers."""

from typing import Any

import numpy as np
import pytest
import torch
from msgspec import Struct
from msgspec.structs import replace
from skrl.memories.torch import RandomMemory

from agent.learning.features import Features
from agent.learning.sac import sac_agent, sac_networks
from agent.learning.sac_update import STATISTICS, SacNetworks, SacUpdate
from agent.learning.skrl_state import network_weights, optimizers_state, restore_optimizers, tracked
from protocol.environment_config import EnvironmentConfig
from protocol.learner_config import SacConfig

CONFIG = SacConfig(hidden_sizes=(32, 24), batch_size=48)


class Learned(Struct):
    """What a number of updates came to."""

    weights: dict[str, Any]
    entropy: float
    statistics: dict[str, float]


class Apprentice:
    """An agent with a memory of made-up transitions; the same one each time."""

    def __init__(self, config: SacConfig, dtype: torch.dtype) -> None:
        torch.set_num_threads(1)
        torch.manual_seed(0)
        self.config = config
        self.networks: SacNetworks = sac_networks(config, Features.space())
        for network in (self.networks.policy, *self.networks.critics, *self.networks.targets):
            network.to(dtype)
        self.memory = RandomMemory(memory_size=500, device="cpu", replacement=True)
        self.agent = sac_agent(config, self.networks, self.memory)
        self.agent.log_entropy_coefficient.data = self.agent.log_entropy_coefficient.data.to(dtype)
        self.agent._entropy_coefficient = self.agent.log_entropy_coefficient.detach().exp()
        self.memory.add_samples(**transitions(500))
        for name in ("observations", "next_observations", "actions", "rewards"):
            self.memory.tensors_view[name] = self.memory.tensors_view[name].to(dtype)
        torch.manual_seed(1)

    def taught_by_skrl(self, updates: int) -> Learned:
        self.agent.write_interval = 1
        for _ in range(updates):
            self.agent.update(timestep=0, timesteps=0)
        return self._learned(tracked(self.agent))

    def taught_by_us(self, updates: int) -> Learned:
        told = SacUpdate(self.config, self.agent, self.networks, self.memory)(updates)
        return self._learned(dict(zip(STATISTICS, np.mean(told, axis=0), strict=True)))

    def _learned(self, statistics: dict[str, float]) -> Learned:
        return Learned(network_weights(self.agent), self.agent.log_entropy_coefficient.item(), statistics)


def transitions(count: int) -> dict[str, Any]:
    drawn = torch.randn(2, count, 111)
    drawn[..., 54:108].abs_()
    features = Features(EnvironmentConfig())
    return {
        "observations": features(drawn[0]),
        "next_observations": features(drawn[1]),
        "actions": torch.rand(count, 3) * 2.0 - 1.0,
        "rewards": torch.randn(count, 1),
        "terminated": torch.rand(count, 1) < 0.1,
    }


def differences(one: Learned, other: Learned) -> np.ndarray:
    """Of every single weight."""
    return np.concatenate([np.abs(one.weights[name] - other.weights[name]).ravel() for name in one.weights])


@pytest.mark.parametrize("hidden", [(16,), (32, 24), (8, 8, 8)])
def test_it_is_skrls_in_double_precision(hidden: tuple[int, ...]) -> None:
    config = replace(CONFIG, hidden_sizes=hidden)
    by_skrl = Apprentice(config, torch.float64).taught_by_skrl(100)
    by_us = Apprentice(config, torch.float64).taught_by_us(100)
    assert differences(by_skrl, by_us).max() < 1e-9
    assert by_us.entropy == pytest.approx(by_skrl.entropy, abs=1e-6)
    assert by_us.statistics == pytest.approx(by_skrl.statistics, abs=1e-6)


def test_in_single_precision_it_differs_by_rounding() -> None:
    by_skrl = Apprentice(SacConfig(), torch.float32).taught_by_skrl(20)
    by_us = Apprentice(SacConfig(), torch.float32).taught_by_us(20)
    apart = differences(by_skrl, by_us)
    # Adam divides a gradient by its own size, so that of a weight whose gradient is all but zero is mostly rounding.
    assert np.mean(apart > 1e-6) < 1e-3
    assert apart.max() < 1e-4
    assert by_us.entropy == pytest.approx(by_skrl.entropy, abs=1e-6)
    assert by_us.statistics == pytest.approx(by_skrl.statistics, abs=1e-6, rel=1e-6)


def test_it_draws_what_skrl_draws() -> None:
    states = []
    for teach in (Apprentice.taught_by_skrl, Apprentice.taught_by_us):
        teach(Apprentice(CONFIG, torch.float32), 3)
        states.append(torch.get_rng_state())
    assert torch.equal(*states)


def test_where_both_critics_agree_each_counts_for_half() -> None:
    twins = [Apprentice(CONFIG, torch.float64) for _ in range(2)]
    for twin in twins:
        twin.networks.critics[1].load_state_dict(twin.networks.critics[0].state_dict())
        twin.networks.targets[1].load_state_dict(twin.networks.targets[0].state_dict())
    by_skrl = twins[0].taught_by_skrl(1)
    torch.manual_seed(1)
    by_us = twins[1].taught_by_us(1)
    assert differences(by_skrl, by_us).max() < 1e-9


def test_it_goes_on_from_optimisers_of_skrls_making() -> None:
    straight, changed = (Apprentice(CONFIG, torch.float64) for _ in range(2))
    expected = straight.taught_by_skrl(6)
    torch.manual_seed(1)
    changed.taught_by_skrl(3)
    restore_optimizers(changed.agent, optimizers_state(changed.agent))
    assert differences(changed.taught_by_us(3), expected).max() < 1e-9


def test_many_at_once_are_one_after_the_other() -> None:
    together, apart = (Apprentice(CONFIG, torch.float32) for _ in range(2))
    one, other = (SacUpdate(CONFIG, pupil.agent, pupil.networks, pupil.memory) for pupil in (together, apart))
    torch.manual_seed(1)
    told = one(11)
    torch.manual_seed(1)
    assert told == [other(1)[0] for _ in range(11)]
    assert differences(together._learned({}), apart._learned({})).max() == 0.0
