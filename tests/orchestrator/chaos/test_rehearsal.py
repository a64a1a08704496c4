"""The injector, on trainings that do nothing: they are as fast as a training can be."""

import msgspec
import pytest

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.chaos.rehearsal import Injector, Shown
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.chaos.schedule import plan
from orchestrator.run.run_directory import RunDirectory
from protocol.records import Progress
from tests.orchestrator.chaos.conftest import DRONES

STEPS = 400
SCHEDULE = plan(3, 4, ("noted",), STEPS, drones=DRONES)


class NoDisplay:
    def show(self, snapshot):
        pass


class Noted(Scenario):
    """Notes how far the training is at each of its parts, and is recovered from at the second look."""

    def __init__(self, flown):
        self.steps = {}
        self._flown = flown
        self._looks = 0

    def setup(self, run):
        self.steps["setup"] = self._flown()

    def fault(self, run):
        self.steps["fault"] = self._flown()
        return run.now()

    def recovered(self, run):
        self._looks += 1
        return self._looks > 1

    def invariant(self, run):
        self.steps["invariant"] = self._flown()


class Breaks(Noted):
    def invariant(self, run):
        raise InvariantBroken("agent did not survive it")


class Rehearsal:
    """A injector, the scenarios that it has made, and the training that it has begun."""

    def __init__(self, run, fly, scenario=Noted):
        self.made = []
        run.begin = lambda: setattr(self, "training", fly(STEPS))
        self.injector = Injector(run, {"noted": self._make}, drones=DRONES, show=Shown(NoDisplay(), ""))
        self._scenario = scenario

    def _make(self, _chance):
        self.made.append(self._scenario(lambda: self.training.flown))
        return self.made[-1]


def test_every_fault_is_played_at_its_step_however_fast_the_training_is(rehearsed, fly):
    rehearsal = Rehearsal(rehearsed, fly)
    rehearsal.injector.inject(SCHEDULE)
    assert rehearsal.injector.not_played == []
    assert [fault.broken for fault in rehearsal.injector.played] == [None] * len(SCHEDULE)
    for planned, made, played in zip(SCHEDULE, rehearsal.made, rehearsal.injector.played, strict=True):
        assert made.steps["setup"] == planned.step
        assert planned.step <= made.steps["fault"] <= planned.fault_until
        assert played.step == planned.step
    rehearsal.training.join(30)
    assert rehearsal.training.flown == STEPS


def test_a_training_is_held_in_a_faults_stretch_until_what_was_hit_is_there_again(rehearsed, fly):
    rehearsal = Rehearsal(rehearsed, fly)
    rehearsal.injector.inject(SCHEDULE)
    assert [made.steps["invariant"] for made in rehearsal.made] == [planned.recovery_until for planned in SCHEDULE]


def test_a_slow_training_has_recovered_when_its_progress_is_beyond_the_step_of_the_fault(rehearsed, fly):
    planned = SCHEDULE[0]
    beyond = planned.step + 2 * DRONES
    rehearsed.failpoints.hold(f"step-{beyond}")

    class Told(Noted):
        def fault(self, run):
            struck = super().fault(run)
            tell(run.directory, time=struck + 1.0, step=beyond)
            return struck

    rehearsal = Rehearsal(rehearsed, fly, Told)
    rehearsal.injector.inject((planned,))
    [played] = rehearsal.injector.played
    assert (played.step, played.seconds, played.broken) == (planned.step, pytest.approx(1.0), None)
    assert rehearsal.made[0].steps["invariant"] == beyond


def tell(run: RunDirectory, *, time: float, step: int) -> None:
    record = Progress(time=time, phase="training", step=step, steps=STEPS, episodes=0, steps_per_second=8.0)
    with run.progress_path.open("ab") as file:
        file.write(msgspec.json.encode(record) + b"\n")


def test_what_is_broken_after_a_fault_is_told_and_the_next_one_is_played(rehearsed, fly):
    rehearsal = Rehearsal(rehearsed, fly, Breaks)
    rehearsal.injector.inject(SCHEDULE[:2])
    assert [fault.broken for fault in rehearsal.injector.played] == ["agent did not survive it"] * 2


def test_a_fault_that_does_not_happen_before_the_end_of_the_run_is_told(rehearsed, fly, monkeypatch):
    monkeypatch.setattr(type(rehearsed), "is_over", True)
    rehearsed.begin = lambda: None
    injector = Injector(rehearsed, {"noted": lambda _: Noted(lambda: 0)}, drones=DRONES, show=Shown(NoDisplay(), ""))
    injector.inject(SCHEDULE[:1])
    assert injector.played == []
    assert injector.not_played == [f"noted: the run ended before step {SCHEDULE[0].step} came"]
