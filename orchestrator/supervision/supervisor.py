"""Starts processes, polls their health, kills those that hang and restarts those that ended."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType

from msgspec.structs import replace

from orchestrator.errors import ProcessFailed, RestartsExhausted
from orchestrator.run.process_record import ProcessRecord
from orchestrator.run.restart import Restart, count_restarts
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.hang_detector import HangDetector, Verdict
from orchestrator.supervision.health_probe import AgentProbe, HealthProbe, WorkerProbe, ended
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.orphans import Orphans, no_orphans
from orchestrator.supervision.recycling import reason_to_recycle
from orchestrator.supervision.registry import Registry
from orchestrator.supervision.restart_budget import RestartBudget
from orchestrator.supervision.supervised_process import (
    DEPENDS_ON,
    IsDone,
    RunningProcess,
    SupervisedProcess,
    hang_words,
    patience_with,
)
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.config import SupervisionConfig
from protocol.errors import DeadlineExceeded
from protocol.messages import Role
from protocol.records import Progress
from protocol.system.exit_code import ExitCode
from protocol.timeouts import Timeouts

_log = logging.getLogger(__name__)


class Supervisor:
    """Supervises the processes of a fleet. It acts in `poll` only.

    Args:
        registry: where agents register; without one, only their progress counts.
        progress: the agent's last progress; None before the first.
        orphans: processes to adopt instead of starting new ones.
        past: restarts by earlier orchestrators of the run; they are counted, but take nothing from a restart budget.
        on_restart: called with each restart.
        lacks: whether our processes need remote workers of a role, and none of these can work.
    """

    def __init__(
        self,
        fleet: Fleet,
        config: SupervisionConfig,
        timeouts: Timeouts,
        *,
        registry: Registry | None = None,
        progress: Callable[[], Progress | None] = lambda: None,
        orphans: Orphans | None = None,
        past: Sequence[Restart] = (),
        on_restart: Callable[[Restart], None] = lambda _: None,
        lacks: Callable[[Role], bool] = lambda _: False,
        clock: Callable[[], float] = time.monotonic,
        wall_clock: Callable[[], float] = time.time,
    ) -> None:
        self._fleet = fleet
        self._config = config
        self._timeouts = timeouts
        self._registry = registry
        self._progress = progress
        self._orphans = orphans or no_orphans()
        self._past = count_restarts(past)
        self._on_restart = on_restart
        self._lacks = lacks
        self._clock = clock
        self._wall_clock = wall_clock
        self._supervised: dict[str, SupervisedProcess] = {}

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        for supervised in self._supervised.values():
            if supervised.running is not None:
                supervised.running.health_probe.close()

    def start(self, launch: Launch, is_done: IsDone | None = None) -> WorkerProcess:
        """Supervise a launch: adopt its orphaned process if there is one, else start a process.

        Args:
            is_done: for an agent; it is restarted until this is true.

        Raises:
            ProcessFailed: the system would not start it.
        """
        supervised = SupervisedProcess(
            launch=launch,
            budget=RestartBudget(self._config),
            patience=patience_with(launch.role, self._timeouts),
            is_done=is_done,
            restarts=self._past.get(launch.name, 0),
        )
        self._supervised[launch.name] = supervised
        found = self._orphans.take(launch)
        if found is None:
            return self._start_process(supervised)
        process = self._fleet.adopt(launch, found.process, found.log_start)
        _log.info("adopted %s, as process %d", launch.name, process.pid, extra={"member": launch.name})
        return self._supervise(supervised, process, age=process.started_at.age if process.started_at else 0.0)

    def supervises(self, name: str) -> bool:
        """Whether a process of this name is supervised."""
        return name in self._supervised

    def release(self, name: str) -> None:
        """Stop supervising a process."""
        supervised = self._supervised.pop(name)
        if supervised.running is not None:
            supervised.running.health_probe.close()

    def is_ready(self, name: str) -> bool:
        """Whether a process can work, as far as is known."""
        return self._supervised[name].is_ready

    def is_over(self, name: str) -> bool:
        """Whether an agent has done its work."""
        return self._supervised[name].over

    def health(self) -> Iterator[Health]:
        """The health of every process, as of the last poll."""
        records = {record.name: record for record in self._fleet.records()}
        for supervised in self._supervised.values():
            found = (
                supervised.running.health_probe.health()
                if supervised.running is not None
                else ended(records[supervised.name])
            )
            yield replace(found, restarts=supervised.restarts)

    def poll(self) -> None:
        """Check every process once; kill, restart or recycle those that need it.

        Raises:
            ProcessFailed: a process ended that can never work, or (`RestartsExhausted`) one ends too often.
            DeadlineExceeded: a worker did not get ready within `timeouts.startup`.
            VersionMismatch, WrongRole: a worker speaks another version, or serves another role.
        """
        # In the order of their start: render workers come before those that wait for them.
        for supervised in self._supervised.values():
            if supervised.running is not None:
                self._check(supervised, supervised.running)
            elif not supervised.over and self._clock() >= supervised.due:
                self._start_process(supervised)
        self._recycle()

    def _start_process(self, supervised: SupervisedProcess) -> WorkerProcess:
        process = self._fleet.start(supervised.launch)
        _log.info("started %s, as process %d", supervised.name, process.pid, extra={"member": supervised.name})
        return self._supervise(supervised, process)

    def _supervise(self, supervised: SupervisedProcess, process: WorkerProcess, age: float = 0.0) -> WorkerProcess:
        record = next(record for record in self._fleet.records() if record.name == supervised.name)
        now = self._clock()
        supervised.running = RunningProcess(
            process, self._health_probe(supervised, record, process), HangDetector(supervised.patience, now, age), now
        )
        return process

    def _health_probe(
        self, supervised: SupervisedProcess, record: ProcessRecord, process: WorkerProcess
    ) -> HealthProbe:
        if supervised.is_worker:
            return WorkerProbe(record, self._timeouts)
        return AgentProbe(process, self._registry, self._progress)

    def _check(self, supervised: SupervisedProcess, running: RunningProcess) -> None:
        if not running.process.is_running:
            self._handle_exit(supervised, running)
            return
        result = running.health_probe.probe(waiting=self._waits(supervised), stopped=running.process.is_stopped)
        if result.ready and not running.ready:
            running.ready = True
            supervised.budget.worked()
            seconds = round(self._clock() - running.began, 3)
            _log.info("%s is ready", supervised.name, extra={"member": supervised.name, "seconds": seconds})
        verdict = running.hang_detector.update(result, self._clock())
        if verdict is Verdict.NEVER_READY and supervised.is_worker:
            raise DeadlineExceeded(_not_ready(running.process, self._timeouts.startup))
        if verdict is not Verdict.FINE and running.hang is None:
            how = hang_words(verdict, supervised.patience)
            running.hang = f"{supervised.name} {how} and was killed (log: {running.process.log})"
            running.process.kill()

    def _waits(self, supervised: SupervisedProcess) -> bool:
        roles = DEPENDS_ON.get(supervised.launch.role, frozenset())
        others = (other for other in self._supervised.values() if other.launch.role in roles)
        return any(map(self._lacks, roles)) or not all(other.is_ready for other in others)

    def _handle_exit(self, supervised: SupervisedProcess, running: RunningProcess) -> None:
        running.health_probe.close()
        supervised.running = None
        if self._registry is not None:
            self._registry.forget(supervised.name, running.process.pid)
        code = running.process.exit_code
        # The system tells an adopted process's exit code to its parent alone; then only its output counts.
        # An agent that was killed because it did not exit may have done its work before.
        ended_well = code in (ExitCode.DONE, None) or running.hang is not None
        if supervised.is_done is not None and ended_well and supervised.is_done():
            supervised.over = True
        elif code == ExitCode.HOPELESS:
            raise ProcessFailed(running.process.exit_reason())
        elif running.draining is not None:
            # It was asked to end, so a kill counts as planned too.
            self._restart(supervised, running.draining, pause=0.0, planned=True)
        else:
            reason = running.hang or running.process.exit_reason()
            self._restart(supervised, reason, self._pause(supervised, reason), planned=False)

    def _pause(self, supervised: SupervisedProcess, reason: str) -> float:
        pause = supervised.budget.charge(self._clock())
        if pause is None:
            raise RestartsExhausted(
                f"{reason}; it was restarted {self._config.max_restarts} times within {self._config.window:g} s already"
            )
        return pause

    def _restart(self, supervised: SupervisedProcess, reason: str, pause: float, *, planned: bool) -> None:
        supervised.restarts += not planned
        supervised.due = self._clock() + pause
        when = f"in {pause:g} s" if pause else "now"
        level = logging.INFO if planned else logging.WARNING
        _log.log(level, "%s; restarting it %s", reason, when, extra={"member": supervised.name, "planned": planned})
        self._note(Restart(time=self._wall_clock(), process=supervised.name, reason=reason, planned=planned))
        if not pause:
            self._start_process(supervised)

    def _note(self, restart: Restart) -> None:
        try:
            self._on_restart(restart)
        except OSError as error:
            # A full disk may be the very reason of the restart.
            _log.warning("the restart can't be recorded: %s", error)

    def _recycle(self) -> None:
        """Replace a worker that reached a limit of memory or requests; one at a time, while all others are ready."""
        workers = [supervised for supervised in self._supervised.values() if supervised.is_worker]
        if not all(
            supervised.running is not None and supervised.running.ready and supervised.running.draining is None
            for supervised in workers
        ):
            return
        for supervised in workers:
            if supervised.running is None or not isinstance(supervised.running.health_probe, WorkerProbe):
                continue
            why = reason_to_recycle(supervised.running.health_probe.pong, self._config)
            if why is not None:
                supervised.running.draining = f"{supervised.name} {why} and is replaced"
                supervised.running.health_probe.drain()
                return


def _not_ready(worker: WorkerProcess, startup: float) -> str:
    words = worker.last_words()
    said = f"; the last line of its log: {words}" if words else ""
    return f"{worker.name} did not get ready within {startup:g} s{said} (log: {worker.log})"
