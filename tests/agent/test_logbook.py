from typing import Any

import numpy as np
import pytest

from agent.environment.stages import StageTimes
from agent.logbook import PROGRESS_EVERY, Clocks, Logbook
from protocol.config import RunConfig, TrainingConfig
from protocol.records import Episode, Progress


class Journal:
    """Keeps what it is given."""

    def __init__(self) -> None:
        self.lines: list[Progress] = []
        self.flights: list[Episode] = []
        self.points: list[tuple[int, dict[str, float]]] = []

    def progress(self, progress: Progress) -> None:
        self.lines.append(progress)

    def episode(self, episode: Episode) -> None:
        self.flights.append(episode)

    def curves(self, step: int, values: dict[str, float]) -> None:
        self.points.append((step, values))


class Clock:
    """Goes on only when told to."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def journal() -> Journal:
    return Journal()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def logbook(journal: Journal, clock: Clock) -> Logbook:
    config = RunConfig(training=TrainingConfig(log_every=6))
    book = Logbook(journal, config, Clocks(wall=lambda: 1e9 + clock(), steady=clock))  # pyright: ignore[reportArgumentType]
    book.begin("training", "sac", 40)
    return book


def objects(*values: Any) -> np.ndarray:
    """As Gymnasium has them in infos; `np.array` would take what is in them apart."""
    array = np.empty(len(values), object)
    array[:] = values
    return array


def infos(render: float, final: bool = False) -> dict[str, Any]:
    """Of a step of two drones, of which the first may have ended its flight."""
    step: dict[str, Any] = {"timings": objects(StageTimes({"render": render}), StageTimes({"render": render}))}
    if final:
        last = {
            "timings": objects(StageTimes({"render": 9.0}), None),
            "total_reward": np.array([-7.0, 0.0]),
            "uncertainty": np.array([2.0, 0.0]),
            "outcome": objects("truncated", None),
            "seed": np.array([3, 0]),
            "length": np.array([100, 0]),
        }
        step |= {"final_info": last, "_final_info": np.array([True, False])}
    return step


def test_progress_is_written_each_second_however_many_steps_that_is(logbook, journal, clock) -> None:
    for _ in range(20):
        clock.now += PROGRESS_EVERY / 4
        logbook.enter(2, infos(0.05), {}, 0.04)
    assert [line.step for line in journal.lines] == [8, 16, 24, 32, 40]
    last = journal.lines[-1]
    assert (last.phase, last.steps, last.time) == ("training", 40, 1e9 + clock())
    assert last.steps_per_second == pytest.approx(8.0)


def test_stages_are_medians_and_learning_is_shared_by_the_drones(logbook) -> None:
    for render in (0.01, 0.05, 0.02):
        logbook.enter(2, infos(render), {}, 0.04)
    assert logbook.stages == {"render": 0.02, "learn": 0.02}


def test_the_last_picture_of_a_flight_counts_too(logbook) -> None:
    logbook.enter(2, infos(0.05, final=True), {}, 0.04)
    logbook.enter(2, infos(9.0), {}, 0.04)
    assert logbook.stages["render"] == 9.0


def test_finished_flights_are_recorded_and_averaged(logbook, journal) -> None:
    logbook.enter(2, infos(0.05, final=True), {}, 0.04)
    logbook.write_progress()
    assert [(flight.seed, flight.policy, flight.total_reward) for flight in journal.flights] == [(3, "sac", -7.0)]
    line = journal.lines[-1]
    assert (line.episodes, line.episode_return, line.uncertainty) == (1, -7.0, 2.0)


def test_curves_have_a_point_each_few_steps_over_all_phases(logbook, journal) -> None:
    losses = iter([1.0, 3.0, 2.0, 5.0, 4.0, 3.0])
    for _ in range(3):
        logbook.enter(2, infos(0.05), {"Loss": next(losses)}, 0.04)
    logbook.begin("evaluation", "sac", 40)
    for _ in range(3):
        logbook.enter(2, infos(0.05), {"Loss": next(losses)}, 0.04)
    assert [(step, values["Loss"]) for step, values in journal.points] == [(6, 2.0), (12, 4.0)]


def test_a_phase_begins_at_its_first_step(logbook, journal) -> None:
    logbook.enter(2, infos(0.05), {}, 0.04)
    logbook.begin("evaluation", "sac", 10)
    logbook.enter(2, infos(0.05), {}, 0.04)
    logbook.write_progress()
    assert (journal.lines[-1].phase, journal.lines[-1].step, journal.lines[-1].steps) == ("evaluation", 2, 10)
