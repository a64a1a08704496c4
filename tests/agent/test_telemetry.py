"""An agent is asked over HTTP how it is, and what it learns stays the same."""

import itertools
import threading
from contextlib import contextmanager, suppress
from pathlib import Path

import httpx
import pytest

from agent.commands import evaluate_run, train_run
from agent.connections import Connections, WorkerAccess
from agent.telemetry import agent_telemetry
from protocol.config import RunConfig, TimeoutsConfig
from protocol.errors import AddressUnavailable
from protocol.messages import Observe, Role, Sampled, SampleScene
from protocol.records import Progress
from protocol.telemetry.info import About
from tests.agent.analytic_sensor import AnalyticSensor, observe
from tests.agent.serving import analytic_workers
from tests.agent.test_commands import CONFIG
from tests.protocol.processes.waiting import wait_until
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.serving import serving

PATIENT = RunConfig(timeouts=TimeoutsConfig(startup=30.0, heartbeat=0.05))
FLYING = Progress(time=1e9, phase="training", step=2, steps=10, episodes=0, steps_per_second=1.0)
SENSOR = AnalyticSensor()
SCENES = {SampleScene: lambda asked: Sampled(scene=SENSOR.sample(asked.seed, asked.split))}
SIGHTS = {Observe: lambda asked: observe(asked.scene, asked.camera, asked.filter)}


@contextmanager
def watched(workers: WorkerAccess, checkpoints: Path):
    """The connections of an agent that does nothing, who is told of its progress, and a monitor."""
    at = free_endpoint()
    with (
        Connections(PATIENT, workers, lambda: None) as connections,
        agent_telemetry(at, About(role=Role.AGENT, name="agent"), connections, checkpoints) as observer,
        monitoring(at) as monitor,
    ):
        yield connections, observer, monitor


@pytest.mark.slow
def test_it_is_ready_while_it_flies_and_has_one_worker_of_each_role(tmp_path: Path) -> None:
    render, perception = f"ipc://{tmp_path}/render", f"ipc://{tmp_path}/perception"
    with watched(WorkerAccess((render,), (perception,)), tmp_path) as (_, observer, monitor):
        assert monitor.waits_on() == {"start", "render", "perception"}
        with serving(SIGHTS, perception, role=Role.PERCEPTION):
            wait_until(lambda: monitor.waits_on() == {"start", "render"})
            with serving(SCENES, render, role=Role.RENDER):
                wait_until(lambda: monitor.waits_on() == {"start"})
                observer.progress(FLYING)
                assert monitor.is_ready()
            wait_until(lambda: monitor.waits_on() == {"render"})
            assert monitor.get("/health/live").status_code == 200
            with serving(SCENES, render, role=Role.RENDER):
                wait_until(monitor.is_ready)


def test_it_names_the_workers_that_it_calls(tmp_path: Path) -> None:
    with analytic_workers(tmp_path) as workers, watched(workers, tmp_path) as (connections, _, monitor):
        told = monitor.json("/info")
    assert (told["role"], told["name"], told["serves"]) == ("agent", "agent", [])
    assert told["calls"] == {"render": list(workers.render), "perception": list(workers.perception)}
    assert told["incarnation"] == connections.incarnation


def run_of(directory: Path, name: str) -> Path:
    run = directory / name
    run.mkdir()
    (run / "config.toml").write_text(CONFIG)
    return run


@contextmanager
def seeing_once(directory: Path, may_see: threading.Event, *, pictures: int = 0):
    """Workers that after so many pictures give no more before somebody says so."""
    numbers = itertools.count()

    def see(asked: Observe):
        if next(numbers) >= pictures:
            may_see.wait(20)
        return observe(asked.scene, asked.camera, asked.filter)

    render, perception = f"ipc://{directory}/render", f"ipc://{directory}/perception"
    with (
        serving(SCENES, render, role=Role.RENDER),
        serving({Observe: see}, perception, role=Role.PERCEPTION),
    ):
        yield WorkerAccess((render,), (perception,))


@pytest.mark.slow
def test_a_training_that_is_asked_all_the_time_learns_the_same(tmp_path: Path) -> None:
    alone, asked = run_of(tmp_path, "alone"), run_of(tmp_path, "asked")
    at, may_see = free_endpoint(), threading.Event()
    answers: list[str] = []

    def ask() -> None:
        with monitoring(at) as monitor:
            wait_until(monitor.is_ready)
            may_see.set()
            while monitor.answers():
                # It may end between the two.
                with suppress(httpx.TransportError):
                    answers.append(monitor.get("/metrics").text)

    with analytic_workers(tmp_path) as workers:
        train_run(alone, workers)
    asking = threading.Thread(target=ask)
    with seeing_once(tmp_path, may_see, pictures=8) as workers:
        asking.start()
        summary = train_run(asked, workers, http=at)
        asking.join()
    assert answers
    assert all('vantage_environment_steps_total{phase="prefill"}' in answer for answer in answers)
    assert summary is not None
    assert (summary.late_replies, summary.retries) == (0, 0)
    for name in ("weights.safetensors", "episodes.jsonl", "replay/000000.bin"):
        assert (asked / name).read_bytes() == (alone / name).read_bytes()


def test_an_evaluation_is_watched_as_well(tmp_path: Path) -> None:
    run, at, may_see = run_of(tmp_path, "run"), free_endpoint(), threading.Event()
    jobs: list[str] = []

    def ask() -> None:
        with monitoring(at) as monitor:
            wait_until(monitor.answers)
            jobs.append(monitor.json("/info")["capabilities"]["job"])
        may_see.set()

    asking = threading.Thread(target=ask)
    with seeing_once(tmp_path, may_see) as workers:
        asking.start()
        evaluation = evaluate_run(run, workers, episodes=1, names=("random",), http=at)
        asking.join()
    assert evaluation is not None
    assert jobs == ["evaluation"]


def test_a_port_in_use_is_told_before_anything_is_written(tmp_path: Path) -> None:
    run, at = run_of(tmp_path, "run"), free_endpoint()
    with (
        analytic_workers(tmp_path) as workers,
        Connections(PATIENT, workers, lambda: None) as connections,
        agent_telemetry(at, About(role=Role.AGENT, name="other"), connections, tmp_path),
        pytest.raises(AddressUnavailable, match="in use"),
    ):
        train_run(run, workers, http=at)
    assert [path.name for path in run.iterdir()] == ["config.toml"]
