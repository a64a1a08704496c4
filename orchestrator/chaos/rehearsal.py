"""Injects a schedule of faults into a run, one after the other, and reports the result."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from pathlib import Path

from msgspec import Struct

from orchestrator.chaos.comparison import compare
from orchestrator.chaos.control_run import ControlRun, control_run
from orchestrator.chaos.errors import InvariantBroken, RunEnded
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.report import ChaosReport, PlayedFault, by_class
from orchestrator.chaos.scenarios.catalogue import MakeScenario
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.chaos.schedule import PlannedFault, plan
from orchestrator.chaos.settings import rehearsal_config
from orchestrator.chaos.step_limit import StepLimit
from orchestrator.monitoring.live_display import Display, Snapshot
from orchestrator.run.config_toml import resolved_toml
from protocol.config_file import load_config
from protocol.system.stop_request import StopRequest

HEAD_START = 0.1
"""Seconds that a training continues after it has waited at a step, and up to as many more, before a fault: so faults
happen not only between two steps."""


class Order(Struct, frozen=True, kw_only=True):
    """A rehearsal to run.

    Attributes:
        scenarios: the fault classes to draw from, by name.
        runs: the directory for both runs.
    """

    config: Path
    faults: int
    seed: int
    scenarios: Mapping[str, MakeScenario]
    runs: Path


def rehearse(order: Order, display: Display, stop: StopRequest) -> ChaosReport:
    """Train a configuration without faults and under faults, and compare.

    Raises:
        RehearsalFailed: a run did not finish.
        InvalidInput: the run is too short for so many faults.
        InvalidConfig: the configuration is invalid.
        Interrupted: the command was asked to stop; no process is left running.
    """
    begun = time.monotonic()
    show = Shown(display, "training without faults, for comparison")
    config = load_config(order.config)
    control = control_run(order.config, config, order.runs, stop, show)
    drones = config.num_envs
    schedule = plan(order.seed, order.faults, tuple(order.scenarios), control.steps, drones=drones)
    touched = order.runs / f"seed-{order.seed}-{datetime.now():%Y%m%d-%H%M%S}"
    rehearsed = rehearsal_config(config, order.faults, control.steps)
    config_path = touched.with_name(touched.name + ".toml")
    config_path.write_bytes(resolved_toml(rehearsed))
    with RehearsedRun(config_path, touched, rehearsed.timeouts, stop, show) as run:
        injector = Injector(run, order.scenarios, drones=drones, show=show)
        injector.inject(schedule)
        show.activity = "training to the end"
        run.finish()
        return _report(order, control, run, injector, drones, time.monotonic() - begun)


class Shown:
    """Displays the progress of a run."""

    def __init__(self, display: Display, activity: str) -> None:
        self.activity = activity
        self._display = display
        self._begun = time.monotonic()

    def __call__(self, run: RehearsedRun) -> None:
        """Show the present progress."""
        elapsed = time.monotonic() - self._begun
        self._display.show(Snapshot(activity=self.activity, elapsed=elapsed, progress=run.progress.last))


class Injector:
    """Injects faults into a run, each at its step, once the run has recovered from the one before.

    A faster training waits, so that all faults happen on any machine.

    Attributes:
        played: the faults that happened, in order.
        not_played: those that did not, each with the reason.
    """

    def __init__(self, run: RehearsedRun, scenarios: Mapping[str, MakeScenario], *, drones: int, show: Shown) -> None:
        self.played: list[PlayedFault] = []
        self.not_played: list[str] = []
        self._run = run
        self._scenarios = scenarios
        self._drones = drones
        self._show = show
        self._limit = StepLimit(run.failpoints)

    def inject(self, schedule: Sequence[PlannedFault]) -> None:
        """Begin the run, and inject all faults; those that do not happen before its end are noted."""
        self._limit.move(schedule[0].step)
        self._run.begin()
        for number, planned in enumerate(schedule, 1):
            where = f"fault {number} of {len(schedule)}, {planned.scenario}"
            try:
                self.played.append(self._inject(planned, where))
            except RunEnded as error:
                self.not_played.append(f"{planned.scenario}: {error}")
        self._limit.lift()

    def _inject(self, planned: PlannedFault, where: str) -> PlayedFault:
        scenario, run = self._scenarios[planned.scenario](planned.chance), self._run
        self._show.activity = f"{where}: due at step {planned.step}"
        self._limit.move(planned.step)
        run.wait(lambda: self._limit.is_reached, f"step {planned.step} came", patience=math.inf)
        scenario.setup(run)
        self._show.activity = f"{where}: under way"
        self._limit.move(planned.fault_until)
        run.sleep(HEAD_START * (1 + planned.chance))
        struck = scenario.fault(run)
        reached = min(max(run.progress.reached(struck), planned.step), planned.fault_until)
        self._show.activity = f"{where}: recovering"
        self._limit.move(planned.recovery_until)
        seconds = self._recover(scenario, struck, reached)
        return PlayedFault(
            scenario=planned.scenario,
            step=reached,
            seconds=seconds,
            steps_again=max(0, reached - (run.progress.lowest_after(struck) or reached)),
            broken=_broken(lambda: scenario.invariant(run)),
        )

    def _recover(self, scenario: Scenario, struck: float, reached: int) -> float:
        """Wait for the recovery; returns the seconds until the training was beyond the step that it had reached."""
        run = self._run
        # One more step of all drones: the step that was reached is known to within that.
        beyond = reached + self._drones
        run.wait(
            lambda: self._limit.is_reached or run.progress.first_beyond(beyond, struck) is not None,
            f"recovery from {type(scenario).__name__} at step {reached}",
        )
        mark = run.progress.first_beyond(beyond, struck)
        seconds = (mark.time if mark else run.now()) - struck
        run.wait(lambda: scenario.recovered(run), f"what {type(scenario).__name__} has hit was there again")
        return seconds


def _broken(invariant: Callable[[], None]) -> str | None:
    try:
        invariant()
    except InvariantBroken as error:
        return str(error)
    return None


def _report(
    order: Order, control: ControlRun, run: RehearsedRun, injector: Injector, drones: int, seconds: float
) -> ChaosReport:
    comparison = compare(control.directory.path, run.directory.path, rows=control.steps // drones, drones=drones)
    summary = run.directory.summary()
    unhurt = not injector.not_played and not any(fault.broken for fault in injector.played)
    return ChaosReport(
        config=str(order.config),
        seed=order.seed,
        passed=comparison.identical and unhurt,
        comparison=comparison,
        classes=by_class(injector.played),
        faults=tuple(injector.played),
        not_played=tuple(injector.not_played),
        retries=summary.retries if summary else 0,
        late_replies=summary.late_replies if summary else 0,
        restarts=run.children.restarts | {"orchestrator": run.resumes},
        control_run=str(control.directory.path),
        control_run_reused=control.reused,
        touched=str(run.directory.path),
        seconds=seconds,
    )
