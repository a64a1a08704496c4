"""The finished flights of a training: their records, and means over the last ones."""

import statistics
from collections import deque
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from agent.environment.flight import succeeded
from protocol.records import Episode, Outcome

RECENT = 20
"""Number of last flights that the means are over."""

SCRIPTED = "scripted"
"""The name of the policy that fills the replay memory."""


class FlightLog:
    """Numbers flights in the order in which they end; those of one step in their drones' order.

    Args:
        success_threshold: weighted uncertainty below which the end of an episode counts as a success; None where the
            environment itself ends an episode that succeeds.
    """

    def __init__(self, success_threshold: float | None) -> None:
        self.count = 0
        self._success_threshold = success_threshold
        self._recent: deque[Episode] = deque(maxlen=RECENT)

    def add(self, infos: Mapping[str, Any], policy: str) -> list[Episode]:
        """Records of the flights that a step ended, flown by the policy of that name; `infos` are `VectorHover`'s."""
        ended = np.flatnonzero(infos["_final_info"]) if "_final_info" in infos else ()
        finals = [{name: values[index] for name, values in infos["final_info"].items()} for index in ended]
        episodes = [self._record(final, policy, self.count + number) for number, final in enumerate(finals)]
        self.count += len(episodes)
        self._recent.extend(episodes)
        return episodes

    @property
    def mean_return(self) -> float | None:
        """Over the last flights; None before the first."""
        return statistics.fmean(episode.total_reward for episode in self._recent) if self._recent else None

    @property
    def mean_uncertainty(self) -> float | None:
        """Weighted uncertainty at their ends, over the last flights; None before the first."""
        return statistics.fmean(episode.uncertainty for episode in self._recent) if self._recent else None

    @property
    def learners_return(self) -> float | None:
        """The mean return, once all of the last flights were the learner's own; None before."""
        own = [episode for episode in self._recent if episode.policy != SCRIPTED]
        return self.mean_return if len(own) == RECENT else None

    def state(self) -> dict[str, Any]:
        """The state that the next records depend on, as plain values."""
        return {"count": self.count, "recent": msgspec.to_builtins(list(self._recent))}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a `state`."""
        self.count = state["count"]
        self._recent = deque(msgspec.convert(state["recent"], list[Episode]), maxlen=RECENT)

    def _record(self, final: Mapping[str, Any], policy: str, number: int) -> Episode:
        outcome, uncertainty = final["outcome"], float(final["uncertainty"])
        return Episode(
            number=number,
            seed=int(final["seed"]),
            policy=policy,
            total_reward=float(final["total_reward"]),
            length=int(final["length"]),
            outcome=outcome,
            uncertainty=uncertainty,
            success=self._succeeded(outcome, uncertainty),
        )

    def _succeeded(self, outcome: Outcome, uncertainty: float) -> bool:
        if self._success_threshold is None:
            return outcome == "succeeded"
        return succeeded(outcome, uncertainty, self._success_threshold)
