"""A task for memory: what the first observation of an episode shows has to be told at its end.

It is on the grid's sizes, but no grid: a learner needs no more of an environment than these.
"""

import copy

import numpy as np

from agent.learning.learner import Learner, Transition
from protocol.learner_config import RecurrentPpoConfig

SMALL = RecurrentPpoConfig(
    lstm_hidden_size=16, hidden_size=8, n_steps=6, n_epochs=2, minibatches=2, ent_coef=0.01, ent_coef_steps=10_000
)
DRONES = 4


class RecallTask:
    """Episodes of `length` steps. The first observation shows one of two cues, the others none.

    The last action pays 1 if it is the cue's and ends the episode, by termination or, with every third, truncation.
    """

    def __init__(self, drones: int = DRONES, length: int = 4, seed: int = 0) -> None:
        self._length = length
        self._random = np.random.default_rng(seed)
        self._cues = self._random.integers(2, size=drones)
        self._ages = self._random.integers(length, size=drones)
        self._ages[:1] = 0
        self._endings = 0
        self.paid: list[float] = []
        self.taken: list[Transition] = []

    @property
    def observations(self) -> np.ndarray:
        return self._observations(self._ages)

    def act(self, learner: Learner) -> np.ndarray:
        return np.asarray(learner.act(self.observations, explore=True))

    def step(self, actions: np.ndarray) -> Transition:
        ends = self._ages == self._length - 1
        rewards = np.where(ends, (actions == self._cues).astype(np.float64), 0.0)
        truncated = ends & ((self._endings + np.arange(len(ends))) % 3 == 0)
        before, after = self.observations, self._observations(self._ages + 1)
        self.paid += rewards[ends].tolist()
        self._endings += 1
        self._ages = np.where(ends, 0, self._ages + 1)
        self._cues = np.where(ends, self._random.integers(2, size=len(ends)), self._cues)
        step = Transition(
            observations=before,
            actions=actions,
            rewards=rewards,
            next_observations=after,
            terminated=ends & ~truncated,
            truncated=truncated,
        )
        self.taken.append(step)
        return step

    def run(self, learner: Learner, steps: int, *, learns_first: bool = True) -> None:
        """As a training does: it learns before it chooses, or while the steps it chose are under way."""
        for _ in range(steps):
            if learns_first:
                learner.learn()
            actions = self.act(learner)
            if not learns_first:
                learner.learn()
            learner.observe(self.step(actions))

    def snapshot(self) -> "RecallTask":
        """The same episodes once more, to go on from here twice."""
        return copy.deepcopy(self)

    def _observations(self, ages: np.ndarray) -> np.ndarray:
        observations = np.zeros((len(ages), 20), np.float32)
        observations[:, 0] = ages
        observations[:, 2:4] = (ages == 0)[:, None] * np.eye(2)[self._cues]
        return observations
