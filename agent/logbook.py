"""Counts a training's finished flights, throughput and seconds by stage, and writes them to the journal."""

import statistics
from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import Any

from msgspec import Struct

from agent.checkpointing.journal import Journal
from agent.environment.stages import StageMedians
from agent.flight_log import FlightLog
from agent.throughput import Throughput
from protocol.config import RunConfig
from protocol.records import Phase, Progress, Stage

PROGRESS_EVERY = 1.0
"""Seconds between two lines of progress; lines are written between steps, so a slow step takes longer."""


class Clocks(Struct, frozen=True):
    """Seconds: `wall` since 1970 for records, `steady` for durations."""

    wall: Callable[[], float]
    steady: Callable[[], float]


class Logbook:
    """The logbook of one training. `begin` a phase, then `enter` each step of it."""

    def __init__(self, journal: Journal, config: RunConfig, clocks: Clocks) -> None:
        self.flights = FlightLog(config.environment.success_threshold if config.env_id == "vantage/Hover-v0" else None)
        self._journal = journal
        self._log_every = config.training.log_every
        self._clocks = clocks
        self._stages = StageMedians()
        self._gathered: defaultdict[str, list[float]] = defaultdict(list)
        self._flown = 0
        self.begin("prefill", "", 0)

    def begin(self, phase: Phase, policy: str, steps: int, *, done: int = 0) -> None:
        """Begin a phase of `steps` environment steps, `done` of them done, flown by the policy of that name."""
        self._phase: Phase = phase
        self._policy = policy
        self._steps = steps
        self._step = done
        self._throughput = Throughput(self._clocks.steady, done)
        self._written = self._clocks.steady()

    def enter(self, drones: int, infos: Mapping[str, Any], learned: Mapping[str, float], learning: float) -> None:
        """A step of every drone: its infos, the learner's statistics, and the seconds that learning took."""
        self._step += drones
        self._flown += drones
        self._throughput.reached(self._step)
        self._time(infos, learning / drones)
        for name, value in learned.items():
            self._gathered[name].append(value)
        for episode in self.flights.add(infos, self._policy):
            self._journal.episode(episode)
        if self._flown % self._log_every < drones:
            self._draw()
        if self._clocks.steady() - self._written >= PROGRESS_EVERY:
            self.write_progress()

    def write_progress(self) -> None:
        """Write a line on how far the training is."""
        self._written = self._clocks.steady()
        self._journal.progress(
            Progress(
                time=self._clocks.wall(),
                phase=self._phase,
                step=self._step,
                steps=self._steps,
                episodes=self.flights.count,
                steps_per_second=self._throughput.steps_per_second,
                episode_return=self.flights.mean_return,
                uncertainty=self.flights.mean_uncertainty,
                stages=self.stages,
            )
        )

    @property
    def flown(self) -> int:
        """Environment steps, over all phases."""
        return self._flown

    def state(self) -> dict[str, Any]:
        """The state that later records depend on, as plain values; the phase under way comes with `begin` again."""
        return {
            "flights": self.flights.state(),
            "flown": self._flown,
            "gathered": dict(self._gathered),
        }

    def stage_times(self) -> dict[Stage, list[float]]:
        """Of the last steps."""
        return self._stages.state()

    def restore(self, state: dict[str, Any], stage_times: Mapping[Stage, list[float]]) -> None:
        """Continue from a `state`; then `begin` the phase that was under way."""
        self.flights.restore(state["flights"])
        self._flown = state["flown"]
        self._gathered = defaultdict(list, state["gathered"])
        self._stages.restore(stage_times)

    @property
    def stages(self) -> dict[Stage, float]:
        """Median seconds that an environment step spends in each stage."""
        return self._stages.medians()

    def _time(self, infos: Mapping[str, Any], learning: float) -> None:
        """Take in the stages of all pictures of a step, the last ones of finished flights included."""
        last_pictures = infos.get("final_info", {}).get("timings", ())
        for times in (*infos["timings"], *last_pictures):
            self._stages.add(times or {})
        self._stages.add({"learn": learning})

    def _draw(self) -> None:
        """Add a point to every curve."""
        values = {name: statistics.fmean(gathered) for name, gathered in self._gathered.items()}
        self._gathered.clear()
        values |= {f"Seconds a step / {stage}": seconds for stage, seconds in self.stages.items()}
        values["Training / Steps a second"] = self._throughput.steps_per_second
        for name, mean in (("return", self.flights.mean_return), ("uncertainty", self.flights.mean_uncertainty)):
            if mean is not None:
                values[f"Flights / Mean {name}"] = mean
        self._journal.curves(self._flown, values)
