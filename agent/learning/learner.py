"""The interface of every learner."""

from collections.abc import Iterable
from typing import Any, Protocol, TypeAlias

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from protocol.arrays import BoolArray, Float32Array, Float64Array

ActionArray: TypeAlias = NDArray[np.float32 | np.int64]
"""Of n drones: velocities (n, 3) in m/s, or on the grid the numbers (n,) of moves."""

Statistics: TypeAlias = dict[str, float]
"""Names as TensorBoard shows them, and values."""


class Transition(Struct, frozen=True, eq=False, kw_only=True):
    """One step of every drone, in flight or on the grid.

    Attributes:
        observations: (n, 111), or (n, 20) on the grid, before the step.
        actions: (n, 3), or (n,) on the grid, that were taken, by the learner's policy or another.
        rewards: (n,).
        next_observations: as `observations`, after the step; the last one of a finished episode, not the first of the
            next.
        terminated: (n,) ended badly: nothing comes after.
        truncated: (n,) ended by the time limit: more would have come.
    """

    observations: Float32Array
    actions: ActionArray
    rewards: Float64Array
    next_observations: Float32Array
    terminated: BoolArray
    truncated: BoolArray


class Learner(Protocol):
    """A policy that learns.

    Attributes:
        off_policy: whether it learns from other policies' flights, such as scripted ones.
        updates: gradient updates done.

    A checkpoint of it has three parts: its `weights`, its `state`, and of a replay memory only the number of steps in
    it, `memory_steps`; they are in a journal, from which `recall` has them back. To go on, do `load_weights`,
    `restore`, `recall`, in this order.
    """

    off_policy: bool
    updates: int

    @property
    def memory_steps(self) -> int:
        """How many of the last steps of all drones are in its replay memory; 0 where it has none."""
        ...

    def act(self, observations: Float32Array, *, explore: bool) -> ActionArray:
        """Actions for the observations of n drones: the best it knows, or with `explore` drawn from its policy.

        A learner with a memory of each drone's episode takes the next observations of all its drones. Without
        `explore` it remembers nothing of them.
        """
        ...

    def observe(self, transition: Transition) -> None:
        """Take in a step. With an on-policy learner, it must be the one of the last `act`."""
        ...

    def learn(self) -> Statistics:
        """Make the updates that are due for what was observed so far; nothing where none are due.

        An action that was chosen and not yet observed counts for the updates after these.
        """
        ...

    def state(self) -> dict[str, Any]:
        """The state that its future depends on beside weights and replay memory, with the random generators.

        Tensors, arrays and plain values, nested: networks' hidden states, optimisers, a rollout under way.
        """
        ...

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state` of a learner of the same configuration, bit for bit."""
        ...

    def recall(self, steps: Iterable[Transition]) -> None:
        """Put the last `memory_steps` back into replay memory: transitions of one step or more, oldest first.

        Their arrays have a leading axis of steps: (k, n, …).
        """
        ...

    def weights(self) -> dict[str, NDArray[Any]]:
        """The parameters of all its networks, by name."""
        ...

    def load_weights(self, weights: dict[str, NDArray[Any]]) -> None:
        """Take the parameters of a learner of the same configuration; alone they are only good for acting.

        Raises:
            ArtifactDamaged: a parameter is missing, unknown, or has another shape.
        """
        ...


def learned_rewards(rewards: Float64Array, floor: float, scale: float) -> Float32Array:
    """Rewards (n,) as critics learn them: cut at `floor`, then scaled.

    A crash costs as much as a whole poor flight. Without the cut, its regression error would exceed all differences
    between views; with it, a crash still costs more than any view. Evaluation uses the original rewards.
    """
    return (np.maximum(rewards, floor) * scale).astype(np.float32)
