"""Keeps processes at work: starts them, looks at them, kills those that hang and starts again those that ended."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType

from msgspec.structs import replace

from orchestrator.errors import ProcessFailed, RestartsExhausted
from orchestrator.run.restart import Restart, count_restarts
from orchestrator.run.run_directory import ProcessRecord
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.hang_detector import HangDetector, Verdict
from orchestrator.supervision.health_probe import AgentProbe, HealthProbe, WorkerProbe, ended
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.left_behind import LeftBehind, nobody
from orchestrator.supervision.recycling import reason_to_recycle
from orchestrator.supervision.registry import Registry
from orchestrator.supervision.restart_budget import RestartBudget
from orchestrator.supervision.supervised_process import (
    DEPENDS_ON,
    IsDone,
    Life,
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
    """Looks after the processes of a fleet; nothing happens between two looks.

    Args:
        registry: where agents are heard of; without one, only their progress counts.
        progress: how far the agent is; None before its first word.
        left_behind: processes to take up instead of starting others.
        past: restarts of earlier orchestrators of the run; they are counted, and charged to nobody.
        on_restart: told of each restart.
        lacks: whether nobody of a role can work elsewhere whom our processes need.
    """

    def __init__(
        self,
        fleet: Fleet,
        config: SupervisionConfig,
        timeouts: Timeouts,
        *,
        registry: Registry | None = None,
        progress: Callable[[], Progress | None] = lambda: None,
        left_behind: LeftBehind | None = None,
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
        self._left_behind = left_behind or nobody()
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
            if supervised.life is not None:
                supervised.life.health_probe.close()

    def start(self, launch: Launch, is_done: IsDone | None = None) -> WorkerProcess:
        """Take a launch into care: take up its process if one was left behind, else start one.

        Args:
            is_done: for an agent; it is started again until this says so.

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
        found = self._left_behind.take(launch)
        if found is None:
            return self._begin(supervised)
        process = self._fleet.adopt(launch, found.process, found.log_start)
        _log.info("took %s up, as process %d", launch.name, process.pid, extra={"member": launch.name})
        return self._attend(supervised, process, age=process.started_at.age if process.started_at else 0.0)

    def cares_for(self, name: str) -> bool:
        """Whether a process is in care."""
        return name in self._supervised

    def release(self, name: str) -> None:
        """Take a process out of care."""
        supervised = self._supervised.pop(name)
        if supervised.life is not None:
            supervised.life.health_probe.close()

    def is_ready(self, name: str) -> bool:
        """Whether a process can work, as far as is known."""
        return self._supervised[name].is_ready

    def is_over(self, name: str) -> bool:
        """Whether an agent has done its work."""
        return self._supervised[name].over

    def health(self) -> Iterator[Health]:
        """Every process, as of the last look."""
        records = {record.name: record for record in self._fleet.records()}
        for supervised in self._supervised.values():
            found = (
                supervised.life.health_probe.health()
                if supervised.life is not None
                else ended(records[supervised.name])
            )
            yield replace(found, restarts=supervised.restarts)

    def look(self) -> None:
        """Look at every process once, and do what is to be done about it.

        Raises:
            ProcessFailed: one ended that can never work, or (`RestartsExhausted`) ends too often.
            DeadlineExceeded: a worker did not get ready before the startup clock ran out.
            VersionMismatch, WrongRole: it is no worker to talk to.
        """
        # In the order of their start: render workers come before those that wait for them.
        for supervised in self._supervised.values():
            if supervised.life is not None:
                self._look_at(supervised, supervised.life)
            elif not supervised.over and self._clock() >= supervised.due:
                self._begin(supervised)
        self._recycle()

    def _begin(self, supervised: SupervisedProcess) -> WorkerProcess:
        process = self._fleet.start(supervised.launch)
        _log.info("started %s, as process %d", supervised.name, process.pid, extra={"member": supervised.name})
        return self._attend(supervised, process)

    def _attend(self, supervised: SupervisedProcess, process: WorkerProcess, age: float = 0.0) -> WorkerProcess:
        record = next(record for record in self._fleet.records() if record.name == supervised.name)
        now = self._clock()
        supervised.life = Life(
            process, self._probe(supervised, record, process), HangDetector(supervised.patience, now, age), now
        )
        return process

    def _probe(self, supervised: SupervisedProcess, record: ProcessRecord, process: WorkerProcess) -> HealthProbe:
        if supervised.is_worker:
            return WorkerProbe(record, self._timeouts)
        return AgentProbe(process, self._registry, self._progress)

    def _look_at(self, supervised: SupervisedProcess, life: Life) -> None:
        if not life.process.is_running:
            self._take_end(supervised, life)
            return
        vitals = life.health_probe.vitals(waiting=self._waits(supervised), stopped=life.process.is_stopped)
        if vitals.ready and not life.ready:
            life.ready = True
            supervised.budget.worked()
            seconds = round(self._clock() - life.began, 3)
            _log.info("%s is ready", supervised.name, extra={"member": supervised.name, "seconds": seconds})
        verdict = life.hang_detector.look(vitals, self._clock())
        if verdict is Verdict.NEVER_READY and supervised.is_worker:
            raise DeadlineExceeded(_not_ready(life.process, self._timeouts.startup))
        if verdict is not Verdict.FINE and life.hang is None:
            life.hang = (
                f"{supervised.name} {hang_words(verdict, supervised.patience)} and was killed (log: {life.process.log})"
            )
            life.process.kill()

    def _waits(self, supervised: SupervisedProcess) -> bool:
        roles = DEPENDS_ON.get(supervised.launch.role, frozenset())
        others = (other for other in self._supervised.values() if other.launch.role in roles)
        return any(map(self._lacks, roles)) or not all(other.is_ready for other in others)

    def _take_end(self, supervised: SupervisedProcess, life: Life) -> None:
        life.health_probe.close()
        supervised.life = None
        if self._registry is not None:
            self._registry.forget(supervised.name, life.process.pid)
        code = life.process.exit_code
        # Whoever is not our child does not tell us its exit code; what it made does.
        if supervised.is_done is not None and code in (ExitCode.DONE, None) and supervised.is_done():
            supervised.over = True
        elif code == ExitCode.HOPELESS:
            raise ProcessFailed(life.process.obituary())
        elif life.draining is not None:
            # Even if it had to be killed: it was to end anyway.
            self._again(supervised, life.draining, pause=0.0, planned=True)
        else:
            self._again(supervised, life.hang or life.process.obituary(), self._pause(supervised, life), planned=False)

    def _pause(self, supervised: SupervisedProcess, life: Life) -> float:
        pause = supervised.budget.charge(self._clock())
        if pause is None:
            reason = life.hang or life.process.obituary()
            raise RestartsExhausted(
                f"{reason}; it was started again {self._config.max_restarts} times within "
                f"{self._config.window:g} s already"
            )
        return pause

    def _again(self, supervised: SupervisedProcess, reason: str, pause: float, *, planned: bool) -> None:
        supervised.restarts += not planned
        supervised.due = self._clock() + pause
        when = f"in {pause:g} s" if pause else "now"
        level = logging.INFO if planned else logging.WARNING
        _log.log(
            level, "%s; it is started again %s", reason, when, extra={"member": supervised.name, "planned": planned}
        )
        self._note(Restart(time=self._wall_clock(), process=supervised.name, reason=reason, planned=planned))
        if not pause:
            self._begin(supervised)

    def _note(self, restart: Restart) -> None:
        try:
            self._on_restart(restart)
        except OSError as error:
            # A full disk may be the very reason of the restart.
            _log.warning("a restart can't be written down: %s", error)

    def _recycle(self) -> None:
        """Replace a worker that has grown or worked enough; one after the other, while all the others can work."""
        workers = [supervised for supervised in self._supervised.values() if supervised.is_worker]
        if not all(
            supervised.life is not None and supervised.life.ready and supervised.life.draining is None
            for supervised in workers
        ):
            return
        for supervised in workers:
            if supervised.life is None or not isinstance(supervised.life.health_probe, WorkerProbe):
                continue
            why = reason_to_recycle(supervised.life.health_probe.pong, self._config)
            if why is not None:
                supervised.life.draining = f"{supervised.name} {why} and is replaced"
                supervised.life.health_probe.drain()
                return


def _not_ready(worker: WorkerProcess, startup: float) -> str:
    words = worker.last_words()
    said = f"; {worker.name} said last: {words}" if words else ""
    return f"{worker.name} did not get ready within {startup:g} s{said} (log: {worker.log})"
