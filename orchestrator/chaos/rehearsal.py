"""Plays a schedule of faults on a run, one after the other, and says what came of it."""

import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path

from msgspec import Struct

from orchestrator.chaos.catalogue import MakeScenario
from orchestrator.chaos.comparison import compare
from orchestrator.chaos.errors import InvariantBroken, NotRecovered, RunEnded
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.report import ChaosReport, PlayedFault, by_class
from orchestrator.chaos.scenario import Scenario
from orchestrator.chaos.schedule import PlannedFault, plan
from orchestrator.chaos.settings import rehearsal_config
from orchestrator.chaos.untouched import Untouched, untouched_run
from orchestrator.live_display import Display, Snapshot
from orchestrator.run_directory import resolved_toml
from orchestrator.stop_request import StopRequest
from protocol.config_file import load_config


class Order(Struct, frozen=True, kw_only=True):
    """What is to be rehearsed.

    Attributes:
        scenarios: the fault classes to draw from, by name.
        runs: the directory that both runs are made in.
    """

    config: Path
    faults: int
    seed: int
    scenarios: Mapping[str, MakeScenario]
    runs: Path


def rehearse(order: Order, display: Display, stop: StopRequest) -> ChaosReport:
    """Fly a configuration untouched and under faults, and compare.

    Raises:
        RehearsalFailed: a run did not come to its end.
        InvalidConfig: the configuration can't be used.
        Interrupted: somebody asked us to stop; nothing is left running.
    """
    begun = time.monotonic()
    show = Shown(display, "flying untouched, to compare with")
    untouched = untouched_run(order.config, order.runs, stop, show)
    config = load_config(order.config)
    touched = order.runs / f"seed-{order.seed}-{datetime.now():%Y%m%d-%H%M%S}"
    rehearsed = rehearsal_config(config, order.faults, untouched.steps)
    config_path = touched.with_name(touched.name + ".toml")
    config_path.write_bytes(resolved_toml(rehearsed))
    with RehearsedRun(config_path, touched, rehearsed.timeouts, stop, show) as run:
        run.begin()
        player = Player(run, order.scenarios, drones=config.environment.num_envs, show=show)
        player.play(plan(order.seed, order.faults, tuple(order.scenarios), untouched.steps))
        show.activity = "flying to the end"
        run.finish()
        return _report(order, untouched, run, player, config.environment.num_envs, time.monotonic() - begun)


class Shown:
    """Tells a display what goes on in a run."""

    def __init__(self, display: Display, activity: str) -> None:
        self.activity = activity
        self._display = display
        self._begun = time.monotonic()

    def __call__(self, run: RehearsedRun) -> None:
        """Show how the run is now."""
        elapsed = time.monotonic() - self._begun
        self._display.show(Snapshot(activity=self.activity, elapsed=elapsed, progress=run.progress.last))


class Player:
    """Plays faults on a run, each when the run has recovered from the one before.

    Attributes:
        played: what happened, in order.
        not_played: what did not, each with the reason.
    """

    def __init__(self, run: RehearsedRun, scenarios: Mapping[str, MakeScenario], *, drones: int, show: Shown) -> None:
        self.played: list[PlayedFault] = []
        self.not_played: list[str] = []
        self._run = run
        self._scenarios = scenarios
        self._drones = drones
        self._show = show

    def play(self, schedule: Sequence[PlannedFault]) -> None:
        """Play all of it; what the run's end leaves no time for is noted."""
        for number, planned in enumerate(schedule, 1):
            where = f"fault {number} of {len(schedule)}, {planned.scenario}"
            try:
                self.played.append(self._play(planned, where))
            except RunEnded as error:
                self.not_played.append(f"{planned.scenario}: {error}")

    def _play(self, planned: PlannedFault, where: str) -> PlayedFault:
        scenario, run = self._scenarios[planned.scenario](planned.chance), self._run
        self._show.activity = f"{where}: from step {planned.step} on"
        run.wait(lambda: run.progress.step >= planned.step, f"step {planned.step} came")
        scenario.setup(run)
        self._show.activity = f"{where}: under way"
        struck = scenario.fault(run)
        reached = run.progress.reached(struck)
        self._show.activity = f"{where}: recovering"
        seconds = self._recover(scenario, struck, reached)
        return PlayedFault(
            scenario=planned.scenario,
            step=reached,
            seconds=seconds,
            steps_again=max(0, reached - (run.progress.lowest_after(struck) or reached)),
            # Once all steps are flown, every process ends as it should.
            broken=None if run.progress.is_done else _broken(lambda: scenario.invariant(run)),
        )

    def _recover(self, scenario: Scenario, struck: float, reached: int) -> float:
        progress = self._run.progress
        # One more step of all drones: what was reached is known to within that.
        self._run.wait(
            lambda: progress.first_beyond(reached + self._drones, struck) is not None and self._is_back(scenario),
            f"recovery from {type(scenario).__name__} at step {reached}",
        )
        mark = progress.first_beyond(reached + self._drones, struck)
        if mark is None:
            raise NotRecovered(f"no progress beyond step {reached}")
        return mark.time - struck

    def _is_back(self, scenario: Scenario) -> bool:
        """Whether what was hit is there again; of a run whose steps are all flown, nothing has to be any more."""
        return self._run.progress.is_done or scenario.recovered(self._run)


def _broken(invariant: Callable[[], None]) -> str | None:
    try:
        invariant()
    except InvariantBroken as error:
        return str(error)
    return None


def _report(
    order: Order, untouched: Untouched, run: RehearsedRun, player: Player, drones: int, seconds: float
) -> ChaosReport:
    comparison = compare(untouched.directory.path, run.directory.path, rows=untouched.steps // drones, drones=drones)
    summary = run.directory.summary()
    unhurt = not player.not_played and not any(fault.broken for fault in player.played)
    return ChaosReport(
        config=str(order.config),
        seed=order.seed,
        passed=comparison.identical and unhurt,
        comparison=comparison,
        classes=by_class(player.played),
        faults=tuple(player.played),
        not_played=tuple(player.not_played),
        retries=summary.retries if summary else 0,
        late_replies=summary.late_replies if summary else 0,
        restarts=run.crew.restarts | {"orchestrator": run.resumes},
        untouched=str(untouched.directory.path),
        untouched_reused=untouched.reused,
        touched=str(run.directory.path),
        seconds=seconds,
    )
