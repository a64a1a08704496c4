"""The workers of an experiment, with stand-ins in their place."""

import os
import signal
from types import SimpleNamespace

import pytest

from orchestrator.experiments.workers import Rate, WorkerPools, experiment_workers, with_workers
from orchestrator.monitoring.live_display import Snapshot
from protocol.config import RunConfig, TimeoutsConfig
from protocol.errors import Interrupted, InvalidInput
from protocol.messages import SampleScene
from protocol.system.stop_request import StopRequest


class Screen:
    def __init__(self) -> None:
        self.shown: list[Snapshot] = []

    def show(self, snapshot: Snapshot) -> None:
        self.shown.append(snapshot)


@pytest.fixture
def stand_ins(monkeypatch, tmp_path, rooms):
    monkeypatch.setenv("PYTHONPATH", str(rooms / "well_behaved"))
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))


def test_a_rate_counts_what_was_done_before_and_not_for_the_speed():
    now = [10.0]
    rate = Rate(100, 60, clock=lambda: now[0])
    for _ in range(20):
        rate.advance()
    now[0] = 12.0
    assert (rate.count.step, rate.count.steps) == (80, 100)
    assert rate.count.steps_per_second == pytest.approx(10.0)


@pytest.mark.parametrize(("perceivers", "renderers"), [(1, 1), (2, 1), (3, 2), (8, 4)])
def test_half_as_many_draw_as_make_sense_of_it(perceivers, renderers):
    config = with_workers(RunConfig(), perceivers)
    assert (config.perception.workers, config.render.workers) == (perceivers, renderers)


def test_perception_workers_that_are_not_alike_are_refused():
    def says(*capabilities: dict[str, str]) -> WorkerPools:
        welcomes = tuple(SimpleNamespace(capabilities=one) for one in capabilities)
        return WorkerPools(SimpleNamespace(), SimpleNamespace(wait_ready=lambda: welcomes), SimpleNamespace())

    assert says({"lifting": "mean"}, {"lifting": "mean"}).capabilities() == {"lifting": "mean"}
    with pytest.raises(InvalidInput, match="lifting"):
        says({"lifting": "mean"}, {"lifting": "nearest"}).capabilities()


@pytest.mark.slow
def test_answers_come_in_order_though_a_worker_is_killed_between_them(stand_ins):
    screen = Screen()
    config = with_workers(RunConfig(timeouts=TimeoutsConfig(heartbeat=0.1)), 1)
    with experiment_workers(config, display=screen, stop=StopRequest()) as workers:
        requests = (SampleScene(seed=seed, split="test") for seed in range(40))
        kinds = []
        for number, answer in enumerate(workers.answers(workers.renderers, requests, "asking", Rate(40))):
            kinds.append(answer.scene.pose.kind)
            if number == 10:
                victim = next(one for one in screen.shown[-1].workers if one.name == "render-0")
                os.kill(victim.pid, signal.SIGKILL)
    assert kinds == [seed % 8 for seed in range(40)]
    assert any(one.activity == "asking" and one.progress is not None for one in screen.shown)


@pytest.mark.slow
def test_a_request_to_stop_ends_the_wait_for_an_answer(stand_ins):
    stop = StopRequest()

    def requests():
        for seed in range(1_000_000):
            if seed == 5:
                stop.ask()
            yield SampleScene(seed=seed, split="test")

    with experiment_workers(with_workers(RunConfig(), 1), display=Screen(), stop=stop) as workers:
        answers = workers.answers(workers.renderers, requests(), "asking")
        with pytest.raises(Interrupted):
            list(answers)
