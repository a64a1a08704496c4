"""Acting by an actor's weights alone, with a memory of each drone's episode so far."""

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Generator, Tensor

from agent.environment.grid.cells import ACTIONS
from agent.learning.recurrent.network import RecurrentNetwork
from agent.learning.weights import load_weights_into
from protocol.arrays import BoolArray, Float32Array
from protocol.learner_config import RecurrentPpoConfig

ACTOR = "actor"
"""The actor's name among a learner's networks; the names of its weights begin with it."""


class RecurrentPolicy:
    """Chooses the actions of any number of drones at once.

    >>> import numpy as np
    >>> from agent.learning.recurrent.policy import RecurrentPolicy, new_actor
    >>> from protocol.learner_config import RecurrentPpoConfig
    >>> policy = RecurrentPolicy(new_actor(RecurrentPpoConfig(lstm_hidden_size=8)))
    >>> policy.start(1000)
    >>> policy.act(np.zeros((1000, 20), np.float32), explore=False).shape
    (1000,)

    Attributes:
        state: (2, l, n, h) what it remembers of each drone's episode; replaced in each step, never changed in place.
    """

    def __init__(self, actor: RecurrentNetwork) -> None:
        self._actor = actor
        self.state = actor.start(0)

    @classmethod
    def of_weights(cls, weights: Mapping[str, NDArray[Any]], config: RecurrentPpoConfig) -> Self:
        """The policy of a learner's weights; those of the critic are not looked at.

        Raises:
            ArtifactDamaged: a parameter is missing, unknown, or has another shape than the configuration says.
        """
        actor = new_actor(config)
        load_weights_into({ACTOR: actor}, {name: own for name, own in weights.items() if name.startswith(f"{ACTOR}.")})
        return cls(actor)

    def start(self, count: int) -> None:
        """Forget all drones; `count` of them begin an episode."""
        self.state = self._actor.start(count)

    def copy(self) -> Self:
        """Another that remembers the same, and from now on its own."""
        other = type(self)(self._actor)
        other.state = self.state
        return other

    def keep(self, drones: NDArray[np.intp]) -> None:
        """Go on with some of the drones alone, in this order."""
        self.state = self.state[:, :, torch.from_numpy(drones)]

    def act(
        self,
        observations: Float32Array,
        starts: BoolArray | None = None,
        *,
        explore: bool,
        generator: Generator | None = None,
    ) -> NDArray[np.int64]:
        """Actions (n,) for observations (n, 20): the most probable, or with `explore` drawn from the policy.

        Args:
            starts: (n,) whether a drone's episode starts with this observation; without it, only after `start`.
            generator: to draw from; by default torch's own.
        """
        begins = torch.zeros(len(observations), dtype=torch.bool) if starts is None else torch.from_numpy(starts)
        logits = self.step(torch.from_numpy(observations), begins)
        return (drawn(logits, generator) if explore else logits.argmax(1)).numpy()

    @torch.no_grad()
    def step(self, observations: Tensor, starts: Tensor) -> Tensor:
        """The logits (n, 8) of the actions for observations (n, 20), which it will remember."""
        sequence = self._actor.run(observations[None], starts[None], self.state)
        self.state = sequence.last_state
        return sequence.outputs[0]


def new_actor(config: RecurrentPpoConfig) -> RecurrentNetwork:
    """An actor whose first policy is all but even."""
    return RecurrentNetwork(config, ACTIONS, head_gain=0.01)


def drawn(logits: Tensor, generator: Generator | None = None) -> Tensor:
    """(n,) an action of each row of logits (n, 8), drawn by their probabilities."""
    return torch.multinomial(logits.softmax(1), 1, generator=generator)[:, 0]


def log_prob(logits: Tensor, actions: Tensor) -> Tensor:
    """(…) the log-probability of actions (…) by logits (…, 8)."""
    return logits.log_softmax(-1).gather(-1, actions.unsqueeze(-1)).squeeze(-1)
