"""The seconds that each stage of a step took."""

import math
import statistics
from collections import deque
from collections.abc import Iterator, Mapping
from typing import get_args

from protocol.client.pending import Pending
from protocol.pose_estimate import PoseEstimate
from protocol.records import Stage


class StageTimes(Mapping[Stage, float]):
    """Seconds by stage of one estimate.

    Any two are equal: the same step flown again is the same step, however long it took.
    """

    def __init__(self, seconds: Mapping[Stage, float]) -> None:
        self._seconds = dict(seconds)

    def __getitem__(self, stage: Stage) -> float:
        return self._seconds[stage]

    def __iter__(self) -> Iterator[Stage]:
        return iter(self._seconds)

    def __len__(self) -> int:
        return len(self._seconds)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StageTimes)

    def __hash__(self) -> int:
        return hash(StageTimes)

    def __repr__(self) -> str:
        return f"StageTimes({self._seconds})"


def times_of(estimate: Pending[PoseEstimate]) -> StageTimes:
    """The stages of an estimate that has come; `transport` is that of both hops, and of packing on the way."""
    measured = estimate.result().timings
    stages: tuple[Stage, ...] = get_args(Stage)
    seconds: dict[Stage, float] = {stage: measured[stage] for stage in stages if stage in measured}
    on_the_way = sum(measured.get(part, 0.0) for part in ("transport", "pack", "unpack"))
    seconds["transport"] = on_the_way + estimate.timing.transport
    return StageTimes(seconds)


class StageMedians:
    """Running medians over the last few hundred steps of each stage."""

    def __init__(self, window: int = 400) -> None:
        self._recent: dict[Stage, deque[float]] = {stage: deque(maxlen=window) for stage in get_args(Stage)}

    def add(self, times: Mapping[Stage, float]) -> None:
        """Take in the stages of one step."""
        for stage, seconds in times.items():
            if math.isfinite(seconds):
                self._recent[stage].append(seconds)

    def state(self) -> dict[Stage, list[float]]:
        """The values that the medians are computed from."""
        return {stage: list(recent) for stage, recent in self._recent.items()}

    def restore(self, state: Mapping[Stage, list[float]]) -> None:
        """Continue from a `state`."""
        for stage, recent in self._recent.items():
            recent.clear()
            recent.extend(state[stage])

    def medians(self) -> dict[Stage, float]:
        """Median seconds of the stages that have values."""
        return {stage: statistics.median(recent) for stage, recent in self._recent.items() if recent}
