"""Works on a run: a fleet of workers, and an agent that trains with them and then flies the evaluation.

A run continues from its present state: a new one from the beginning, one whose orchestrator was killed from the
processes and files that are left. In a run that joins a host, the agent is the only process that is started here.
"""

import logging
import time
from collections.abc import Generator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path

from msgspec import Struct

from orchestrator.errors import RunBusy
from orchestrator.hosting.joining import Join, JoinedHost, dismiss
from orchestrator.hosting.remote_workers import NO_REMOTE_WORKERS
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
from orchestrator.supervision.orphans import Orphan, Orphans
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
    """The launch of an agent, the name of its work for display, and whether that is done."""

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
        """The names of the launches whose orphans are adopted.

        Of the agents only the first: an orphaned evaluation that runs before the training is done flies other weights.
        """
        return (
            {launch.name for launch in (*self.workers, *(job.launch for job in self.jobs[:1]))} if self.jobs else set()
        )


def train(
    run: RunDirectory, config: RunConfig, *, monitors: Monitors, stop: StopRequest, join: Join | None = None
) -> None:
    """Train on a new run, and fly its evaluation with the same workers if one is planned.

    Args:
        config: the configuration that the run was made with.
        join: a host whose workers do the work; without one, workers are started here.

    Raises:
        ProcessFailed: a process ended that can never work, or ended too often.
        DeadlineExceeded: the workers were not ready in time.
        Interrupted: the command was asked to stop; the agent wrote what it had learned, if it had begun.
        NotPermitted, VersionMismatch, WrongRole: the host refuses us.
        HostLost: the host was unreachable for too long.
        HostNotTold: the run is done, and the host could not be told.
    """
    with _at_work(run) as sockets:
        plan = _plan_to_finish(run, config, sockets, join)
        # A process that serves at our sockets now belongs to an earlier run of this path, with another configuration.
        orphans = Orphans((), (*plan.workers, *plan.agents), ())
        with _noting_its_end(run, join):
            _do_jobs(run, sockets, plan, orphans, monitors, stop)
        _dismiss(config, join, monitors.display, stop)


def resume(
    run: RunDirectory, config: RunConfig, *, monitors: Monitors, stop: StopRequest, join: Join | None = None
) -> None:
    """Continue a run from its present state to its end; a finished run is neither worked on nor written to.

    Raises:
        RunBusy: an orchestrator works on it.
        Others: as `train` does.
    """
    if _is_over(run, config, join):
        # The orchestrator that finished it may have been killed before it told the host.
        _dismiss(config, join, monitors.display, stop)
        return
    with _at_work(run) as sockets:
        plan = _plan_to_finish(run, config, sockets, join)
        with _noting_its_end(run, join) if plan.jobs else nullcontext():
            _do_jobs(run, sockets, plan, _orphans_of(run, plan), monitors, stop)
        _dismiss(config, join, monitors.display, stop)


def evaluate(run: RunDirectory, config: RunConfig, what: Evaluate, *, display: Display, stop: StopRequest) -> None:
    """Fly an evaluation of a run that was trained.

    Raises:
        RunBusy: an orchestrator works on it, or its training continues without one.
        ProcessFailed, DeadlineExceeded, Interrupted: as `train` does.
    """
    with _at_work(run) as sockets:
        workers, training = _workers_and_training(run, config, sockets, None)
        evaluation = evaluation_launch(run.path, workers, sockets, what)
        before = run.evaluation()
        job = Job(evaluation, "evaluation", lambda: run.is_evaluated_since(before))
        plan = LaunchPlan(config, workers, (training, evaluation), (job,))
        orphans = _orphans_of(run, plan)
        if any(found.launch.name == TRAINING for found in orphans.unwanted):
            resumption = f"'orchestrator resume {run.path}'"
            raise RunBusy(f"the training of {run.path} continues without an orchestrator; take it over by {resumption}")
        _do_jobs(run, sockets, plan, orphans, Monitors(display), stop)


@contextmanager
def _at_work(run: RunDirectory) -> Generator[Path]:
    """Be the only orchestrator that works on a run, with a log; yields the directory for its sockets."""
    with run.lock(), run_sockets(run.path) as sockets, run_log(run.orchestrator_log):
        yield sockets


def _is_over(run: RunDirectory, config: RunConfig, join: Join | None) -> bool:
    """Whether there is no job to do and no orphan to end: such a run may be read-only."""
    plan = _plan_to_finish(run, config, sockets_of(run.path), join)
    return not plan.jobs and not _orphans_of(run, plan).unwanted


def _plan_to_finish(run: RunDirectory, config: RunConfig, sockets: Path, join: Join | None) -> LaunchPlan:
    """The launches and jobs that finish a run."""
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


def _orphans_of(run: RunDirectory, plan: LaunchPlan) -> Orphans:
    return Orphans(run.processes(), (*plan.workers, *plan.agents), plan.adoptable())


@contextmanager
def _noting_its_end(run: RunDirectory, join: Join | None) -> Generator[None]:
    """Work on a run and record how that ended; an error gets a note that says how to continue."""
    run.begin()
    try:
        yield
    except BaseException as error:
        _note(run, ending_by(error, time.time()))
        if isinstance(error, VantageError):
            joining = f" --join {join.address}" if join else ""
            error.add_note(f"continue the run by 'orchestrator resume {run.path}{joining}'")
        raise
    _note(run, Ending(time=time.time(), outcome="finished"))


def _note(run: RunDirectory, ending: Ending) -> None:
    try:
        run.end(ending)
    except OSError as error:
        # A full disk may be the very reason; `status` works without this file.
        _log.warning("the end of the run can't be recorded: %s", reason(error))


def _do_jobs(
    run: RunDirectory, sockets: Path, plan: LaunchPlan, orphans: Orphans, monitors: Monitors, stop: StopRequest
) -> None:
    """Do the jobs, one after the other, with the same workers."""
    _end(orphans, run.logs, stop)
    if not plan.jobs:
        return
    with _session(run, sockets, plan, orphans, monitors, stop) as session:
        first = plan.jobs[0]
        if orphans.has(first.launch):
            # First: from now on it is ended with the others, whatever fails or is stopped.
            session.start(first.launch, first.is_done)
        session.start_workers(plan.workers)
        session.wait_for_remote_workers(plan.config.timeouts.startup)
        for job in plan.jobs:
            session.run(job.launch, job.activity, job.is_done)


@contextmanager
def _session(
    run: RunDirectory,
    sockets: Path,
    plan: LaunchPlan,
    orphans: Orphans,
    monitors: Monitors,
    stop: StopRequest,
) -> Generator[Session]:
    """A session on the run; all its processes have ended afterwards."""
    config, join = plan.config, plan.join
    timeouts = Timeouts.from_config(config.timeouts)
    with ExitStack() as held:
        remote_workers = NO_REMOTE_WORKERS if join is None else held.enter_context(JoinedHost(join, run.name, timeouts))
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
                orphans=orphans,
                past=run.restarts(),
                on_restart=run.note_restart,
                lacks=remote_workers.lacks,
            )
        )
        yield Session(fleet, supervisor, monitors.display, stop, run.progress, run.orchestrator_log, remote_workers)


def _dismiss(config: RunConfig, join: Join | None, display: Display, stop: StopRequest) -> None:
    """Tell the host that the run is done, if it has joined one."""
    if join is None:
        return
    began = time.monotonic()

    def show(activity: str) -> None:
        display.show(Snapshot(activity=activity, elapsed=time.monotonic() - began))

    dismiss(join, Timeouts.from_config(config.timeouts), show, stop)


def _end(orphans: Orphans, logs: Path, stop: StopRequest) -> None:
    """End the orphans that are not adopted: agents first, since they need the workers to finish."""
    agents = [found for found in orphans.unwanted if found.launch.role is Role.AGENT]
    others = [found for found in orphans.unwanted if found.launch.role is not Role.AGENT]
    for found, patience in ((agents, AGENT_PATIENCE), (others, WORKER_PATIENCE)):
        end_processes([_process(one, logs) for one in found], patience, stop)


def _process(found: Orphan, logs: Path) -> WorkerProcess:
    _log.warning(
        "ending %s, which an earlier orchestrator left running as process %d", found.launch.name, found.process.pid
    )
    return WorkerProcess.adopt(found.launch, found.process, logs / f"{found.launch.name}.jsonl", found.log_start)
