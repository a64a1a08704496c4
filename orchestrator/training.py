"""The main job: a fleet of workers and an agent that trains on what they see, then flies its evaluation.

A run is always brought to its end from wherever it stands: a new one from nothing, one whose orchestrator was killed
from the processes and files that it left. Where it joins a host, the agent is the only process that is started here.
"""

import logging
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

from msgspec import Struct

from orchestrator.errors import RunBusy
from orchestrator.hosting.joining import Join, JoinedHost, dismiss
from orchestrator.hosting.remote_workers import NOBODY_ELSEWHERE
from orchestrator.monitoring.live_display import Display, Snapshot
from orchestrator.monitoring.telemetry import Monitors
from orchestrator.run.ending import Ending, ending_by
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.run_log import run_log
from orchestrator.run.socket_directory import run_sockets, sockets_of
from orchestrator.session import Session
from orchestrator.supervision.fleet import AGENT_PATIENCE, WORKER_PATIENCE, Fleet, end_processes
from orchestrator.supervision.launch import (
    TRAINING,
    Evaluate,
    Launch,
    evaluation_launch,
    registry_address,
    training_launch,
    worker_launches,
)
from orchestrator.supervision.left_behind import Found, LeftBehind
from orchestrator.supervision.registry import Registry, serve_registry
from orchestrator.supervision.supervised_process import IsDone
from orchestrator.supervision.supervisor import Supervisor
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.config import RunConfig
from protocol.errors import VantageError
from protocol.messages import Role
from protocol.system.refusal import reason
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts

_log = logging.getLogger(__name__)


class Job(Struct, frozen=True, eq=False):
    """An agent's work, what it is called for people, and when it is done."""

    launch: Launch
    activity: str
    is_done: IsDone


class LaunchPlan(Struct, frozen=True, eq=False):
    """Every process that a run may need, as it is started, and the jobs to do now.

    Attributes:
        config: the run's configuration, as it was read once for all of this.
        join: the host whose workers do the work in place of our own.
    """

    config: RunConfig
    workers: tuple[Launch, ...]
    agents: tuple[Launch, ...]
    jobs: tuple[Job, ...]
    join: Join | None = None

    def adoptable(self) -> set[str]:
        """The names of those that are needed now.

        Of the agents only the first one: an evaluation that runs while training is missing flies other weights.
        """
        return (
            {launch.name for launch in (*self.workers, *(job.launch for job in self.jobs[:1]))} if self.jobs else set()
        )


def train(
    run: RunDirectory, config: RunConfig, *, monitors: Monitors, stop: StopRequest, join: Join | None = None
) -> None:
    """Train on a new run, and fly its evaluation with the same workers if it is to have one.

    Args:
        config: the run's, as it was made with it.
        join: a host whose workers do the work; without one, workers are started here.

    Raises:
        ProcessFailed: a process ended that can't work, or ended too often.
        DeadlineExceeded: the workers were not ready in time.
        Interrupted: somebody asked to stop; the agent wrote what it had learned, if it had begun.
        NotPermitted, VersionMismatch, WrongRole: the host won't work with us.
        HostLost: it is gone for too long.
        HostNotTold: all is done, and it does not know.
    """
    with _at_work(run) as sockets:
        plan = _plan_to_finish(run, config, sockets, join)
        # Who serves at our sockets now was started on another run of this path, and has loaded what that was told.
        left_behind = LeftBehind((), (*plan.workers, *plan.agents), ())
        with _noting_its_end(run, join):
            _perform(run, sockets, plan, left_behind, monitors, stop)
        _dismiss(config, join, monitors.display, stop)


def resume(
    run: RunDirectory, config: RunConfig, *, monitors: Monitors, stop: StopRequest, join: Join | None = None
) -> None:
    """Bring a run to its end from wherever it stands; nothing is done, nor written, where it is there already.

    Raises:
        RunBusy: an orchestrator works on it.
        Others: as `train` does.
    """
    if _is_over(run, config, join):
        # Whoever did it may have been killed before it could say so.
        _dismiss(config, join, monitors.display, stop)
        return
    with _at_work(run) as sockets:
        plan = _plan_to_finish(run, config, sockets, join)
        with _noting_its_end(run, join) if plan.jobs else nullcontext():
            _perform(run, sockets, plan, _left_behind(run, plan), monitors, stop)
        _dismiss(config, join, monitors.display, stop)


def evaluate(run: RunDirectory, config: RunConfig, what: Evaluate, *, display: Display, stop: StopRequest) -> None:
    """Fly an evaluation of a run that was trained.

    Raises:
        RunBusy: an orchestrator works on it, or its training goes on without one.
        ProcessFailed, DeadlineExceeded, Interrupted: as `train` does.
    """
    with _at_work(run) as sockets:
        workers, training = _workers_and_training(run, config, sockets, None)
        evaluation = evaluation_launch(run.path, workers, sockets, what)
        before = run.evaluation()
        job = Job(evaluation, "evaluation", lambda: run.is_evaluated_since(before))
        plan = LaunchPlan(config, workers, (training, evaluation), (job,))
        left_behind = _left_behind(run, plan)
        if any(found.launch.name == TRAINING for found in left_behind.in_the_way):
            resumption = f"'orchestrator resume {run.path}'"
            raise RunBusy(f"the training of {run.path} goes on without its orchestrator; take it up by {resumption}")
        _perform(run, sockets, plan, left_behind, Monitors(display), stop)


@contextmanager
def _at_work(run: RunDirectory) -> Generator[Path]:
    """Be the only orchestrator that works on a run, with a log and a directory for sockets, which is given."""
    with run.lock(), run_sockets(run.path) as sockets, run_log(run.orchestrator_log):
        yield sockets


def _is_over(run: RunDirectory, config: RunConfig, join: Join | None) -> bool:
    """Whether nothing is to be done and nobody to be ended: then looking is enough, and needs no right to write."""
    plan = _plan_to_finish(run, config, sockets_of(run.path), join)
    return not plan.jobs and not _left_behind(run, plan).in_the_way


def _plan_to_finish(run: RunDirectory, config: RunConfig, sockets: Path, join: Join | None) -> LaunchPlan:
    """What it takes to bring a run to its end."""
    workers, training = _workers_and_training(run, config, sockets, join)
    evaluation = evaluation_launch(run.path, workers, sockets, Evaluate(), join.options if join else ())
    jobs: list[Job] = []
    if not run.is_trained():
        jobs.append(Job(training, "training", run.is_trained))
    if run.plan().evaluate and not (run.is_trained() and run.is_evaluated()):
        jobs.append(Job(evaluation, "evaluation", run.is_evaluated))
    return LaunchPlan(config, workers, (training, evaluation), tuple(jobs), join)


def _workers_and_training(
    run: RunDirectory, config: RunConfig, sockets: Path, join: Join | None
) -> tuple[tuple[Launch, ...], Launch]:
    if join is not None:
        return (), training_launch(run.path, (), sockets, join.options)
    workers = worker_launches(config, run.config_path, sockets)
    return workers, training_launch(run.path, workers, sockets)


def _left_behind(run: RunDirectory, plan: LaunchPlan) -> LeftBehind:
    return LeftBehind(run.processes(), (*plan.workers, *plan.agents), plan.adoptable())


@contextmanager
def _noting_its_end(run: RunDirectory, join: Join | None) -> Generator[None]:
    """Work on a run, whose end is written down and, where it came before all was done, told with how to go on."""
    run.begin()
    try:
        yield
    except BaseException as error:
        _note(run, ending_by(error, time.time()))
        if isinstance(error, VantageError):
            joining = f" --join {join.address}" if join else ""
            error.add_note(f"go on with the run by 'orchestrator resume {run.path}{joining}'")
        raise
    _note(run, Ending(time=time.time(), outcome="finished"))


def _note(run: RunDirectory, ending: Ending) -> None:
    try:
        run.end(ending)
    except OSError as error:
        # A full disk may be the very reason; what is known without this file is told.
        _log.warning("how the run ended can't be written down: %s", reason(error))


def _perform(
    run: RunDirectory, sockets: Path, plan: LaunchPlan, left_behind: LeftBehind, monitors: Monitors, stop: StopRequest
) -> None:
    """Do the jobs, one after the other, with the same workers."""
    _end(left_behind, run.logs, stop)
    if not plan.jobs:
        return
    with _session(run, sockets, plan, left_behind, monitors, stop) as session:
        first = plan.jobs[0]
        if left_behind.has(first.launch):
            # Before anything can go wrong or be stopped: whoever is in care is brought to its end with the others.
            session.start(first.launch, first.is_done)
        session.start_workers(plan.workers)
        session.wait_for_others(plan.config.timeouts.startup)
        for job in plan.jobs:
            session.run(job.launch, job.activity, job.is_done)


@contextmanager
def _session(
    run: RunDirectory,
    sockets: Path,
    plan: LaunchPlan,
    left_behind: LeftBehind,
    monitors: Monitors,
    stop: StopRequest,
) -> Generator[Session]:
    """A session on the run; no process of it is left when this ends."""
    config, join = plan.config, plan.join
    timeouts = Timeouts.from_config(config.timeouts)
    with ExitStack() as held:
        remote_workers = NOBODY_ELSEWHERE if join is None else held.enter_context(JoinedHost(join, run.name, timeouts))
        registry = Registry(timeouts.liveness, beyond=remote_workers.lookup)
        held.enter_context(serve_registry(registry, registry_address(sockets), timeouts, monitors.registry))
        fleet = held.enter_context(Fleet(run.logs, stop, run.write_processes, sockets=sockets))
        supervisor = held.enter_context(
            Supervisor(
                fleet,
                config.supervision,
                timeouts,
                registry=registry,
                progress=run.progress,
                left_behind=left_behind,
                past=run.restarts(),
                on_restart=run.note_restart,
                lacks=remote_workers.lacks,
            )
        )
        yield Session(fleet, supervisor, monitors.display, stop, run.progress, run.orchestrator_log, remote_workers)


def _dismiss(config: RunConfig, join: Join | None, display: Display, stop: StopRequest) -> None:
    """Let the host know that the run is done, if it has joined one."""
    if join is None:
        return
    began = time.monotonic()

    def show(activity: str) -> None:
        display.show(Snapshot(activity=activity, elapsed=time.monotonic() - began))

    dismiss(join, Timeouts.from_config(config.timeouts), show, stop)


def _end(left_behind: LeftBehind, logs: Path, stop: StopRequest) -> None:
    """End what an earlier orchestrator left and nobody needs: agents first, as ever."""
    agents = [found for found in left_behind.in_the_way if found.launch.role is Role.AGENT]
    others = [found for found in left_behind.in_the_way if found.launch.role is not Role.AGENT]
    for found, patience in ((agents, AGENT_PATIENCE), (others, WORKER_PATIENCE)):
        end_processes([_process(one, logs) for one in found], patience, stop)


def _process(found: Found, logs: Path) -> WorkerProcess:
    _log.warning("%s was left behind, as process %d, and is ended", found.launch.name, found.process.pid)
    return WorkerProcess.adopt(found.launch, found.process, logs / f"{found.launch.name}.jsonl", found.log_start)
