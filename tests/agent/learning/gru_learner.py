"""A small learner with a memory of its own: a GRU whose hidden state goes on from step to step within a flight.

It stands for all on-policy learners with a hidden state and a rollout under way, such as the grid experiment's: it
learns to tell the reward of a step from what it remembers, once every few steps, through time.
"""

import copy
from collections.abc import Iterable
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from agent.learning.learner import Statistics, Transition
from agent.learning.randomness import random_state, restore_random_state, seed_all
from protocol.arrays import Float32Array

_HIDDEN = 8


class RecurrentLearner:
    off_policy = False
    memory_steps = 0

    def __init__(self, drones: int, *, rollout: int = 5, seed: int = 0) -> None:
        torch.set_num_threads(1)
        seed_all(seed)
        self.updates = 0
        self._rollout = rollout
        self._cell = nn.GRUCell(111, _HIDDEN)
        self._heads = nn.ModuleDict({"velocity": nn.Linear(_HIDDEN, 3), "reward": nn.Linear(_HIDDEN, 1)})
        self._networks = nn.ModuleDict({"cell": self._cell, "heads": self._heads})
        self._optimizer = torch.optim.Adam(self._networks.parameters(), lr=1e-2)
        self._hidden = torch.zeros(drones, _HIDDEN)
        self._first = self._hidden
        self._steps: list[dict[str, torch.Tensor]] = []

    def act(self, observations: Float32Array, *, explore: bool) -> Float32Array:
        with torch.no_grad():
            hidden = self._cell(torch.from_numpy(observations), self._hidden)
            velocities = torch.tanh(self._heads["velocity"](hidden))
            if explore:
                self._hidden = hidden
                velocities = velocities + 0.3 * torch.randn_like(velocities)
            return velocities.numpy()

    def observe(self, transition: Transition) -> None:
        over = torch.from_numpy(transition.terminated | transition.truncated)
        seen = torch.from_numpy(transition.observations)
        rewards = torch.from_numpy(transition.rewards.astype(np.float32))
        self._steps.append({"observations": seen, "rewards": rewards, "over": over})
        self._hidden = self._hidden * ~over[:, None]

    def learn(self) -> Statistics:
        if len(self._steps) < self._rollout:
            return {}
        hidden, loss = self._first, torch.zeros(())
        for step in self._steps:
            hidden = self._cell(step["observations"], hidden)
            loss = loss + (self._heads["reward"](hidden)[:, 0] - step["rewards"]).square().mean()
            hidden = hidden * ~step["over"][:, None]
        self._optimizer.zero_grad()
        loss.backward()
        self._optimizer.step()
        self._steps, self._first = [], self._hidden
        self.updates += 1
        return {"Loss / Reward": loss.item()}

    def state(self) -> dict[str, Any]:
        return {
            "optimizer": copy.deepcopy(self._optimizer.state_dict()),
            "hidden": self._hidden.clone(),
            "first": self._first.clone(),
            "steps": [{name: tensor.clone() for name, tensor in step.items()} for step in self._steps],
            "updates": self.updates,
            "random": random_state(),
        }

    def restore(self, state: dict[str, Any]) -> None:
        self._optimizer.load_state_dict(state["optimizer"])
        self._hidden, self._first, self._steps = state["hidden"], state["first"], state["steps"]
        self.updates = state["updates"]
        restore_random_state(state["random"])

    def recall(self, steps: Iterable[Transition]) -> None:
        """It has no replay memory."""

    def weights(self) -> dict[str, NDArray[Any]]:
        return {name: tensor.detach().numpy().copy() for name, tensor in self._networks.state_dict().items()}

    def load_weights(self, weights: dict[str, NDArray[Any]]) -> None:
        self._networks.load_state_dict({name: torch.tensor(array) for name, array in weights.items()})
