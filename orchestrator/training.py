"""The main job: a fleet of workers and an agent that trains on what they see, then flies its evaluation."""

from collections.abc import Iterator
from contextlib import contextmanager

from orchestrator.fleet import Fleet
from orchestrator.launch import Evaluate, Launch, evaluation_launch, training_launch, worker_launches
from orchestrator.live_display import Display
from orchestrator.run_directory import RunDirectory
from orchestrator.session import Session
from orchestrator.socket_directory import socket_directory
from orchestrator.stop_request import StopRequest
from protocol.timeouts import Timeouts


def train(run: RunDirectory, *, evaluate: bool, display: Display, stop: StopRequest) -> None:
    """Train on a new run, and fly its evaluation with the same workers.

    Raises:
        ProcessFailed: a process ended that should not have.
        DeadlineExceeded: the workers were not ready in time.
        Interrupted: somebody asked to stop; the agent wrote what it had learned, if it had begun.
    """
    with _crew(run, display, stop) as (session, workers):
        session.run(training_launch(run.path, workers), "training")
        if evaluate:
            session.run(evaluation_launch(run.path, workers, Evaluate()), "evaluation")


def evaluate(run: RunDirectory, what: Evaluate, *, display: Display, stop: StopRequest) -> None:
    """Fly an evaluation of a run that was trained.

    Raises:
        ProcessFailed, DeadlineExceeded, Interrupted: as `train` does.
    """
    with _crew(run, display, stop) as (session, workers):
        session.run(evaluation_launch(run.path, workers, what), "evaluation")


@contextmanager
def _crew(run: RunDirectory, display: Display, stop: StopRequest) -> Iterator[tuple[Session, tuple[Launch, ...]]]:
    """The run's workers, ready; none of them is left when this ends."""
    config = run.config()
    timeouts = Timeouts.from_config(config.timeouts)
    with (
        run.lock(),
        socket_directory() as sockets,
        Fleet(run.logs, stop, run.write_processes) as fleet,
        Session(fleet, display, stop, timeouts, run.progress) as session,
    ):
        workers = worker_launches(config, run.config_path, sockets)
        session.start_workers(workers)
        yield session, workers
