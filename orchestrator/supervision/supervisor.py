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
from orchestrator.supervision.hang_detector import Verdict, Watch
from orchestrator.supervision.health_probe import AgentPulse, Pulse, WorkerPulse, ended
from orchestrator.supervision.heartbeat import Health
from orchestrator.supervision.launch_plan import Launch
from orchestrator.supervision.left_behind import LeftBehind, nobody
from orchestrator.supervision.recycling import reason_to_recycle
from orchestrator.supervision.registry import Registry
from orchestrator.supervision.restart_budget import RestartBudget
from orchestrator.supervision.supervised_process import DEPENDS_ON, IsDone, Life, Ward, hang_words, patience_with
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
        self._wards: dict[str, Ward] = {}

    def __enter__(self) -> "Supervisor":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        for ward in self._wards.values():
            if ward.life is not None:
                ward.life.pulse.close()

    def start(self, launch: Launch, is_done: IsDone | None = None) -> WorkerProcess:
        """Take a launch into care: take up its process if one was left behind, else start one.

        Args:
            is_done: for an agent; it is started again until this says so.

        Raises:
            ProcessFailed: the system would not start it.
        """
        ward = Ward(
            launch=launch,
            budget=RestartBudget(self._config),
            patience=patience_with(launch.role, self._timeouts),
            is_done=is_done,
            restarts=self._past.get(launch.name, 0),
        )
        self._wards[launch.name] = ward
        found = self._left_behind.take(launch)
        if found is None:
            return self._begin(ward)
        process = self._fleet.adopt(launch, found.process, found.log_start)
        _log.info("took %s up, as process %d", launch.name, process.pid, extra={"member": launch.name})
        return self._attend(ward, process, age=process.started_at.age if process.started_at else 0.0)

    def cares_for(self, name: str) -> bool:
        """Whether a process is in care."""
        return name in self._wards

    def release(self, name: str) -> None:
        """Take a process out of care."""
        ward = self._wards.pop(name)
        if ward.life is not None:
            ward.life.pulse.close()

    def is_ready(self, name: str) -> bool:
        """Whether a process can work, as far as is known."""
        return self._wards[name].is_ready

    def is_over(self, name: str) -> bool:
        """Whether an agent has done its work."""
        return self._wards[name].over

    def health(self) -> Iterator[Health]:
        """Every process, as of the last look."""
        records = {record.name: record for record in self._fleet.records()}
        for ward in self._wards.values():
            found = ward.life.pulse.health() if ward.life is not None else ended(records[ward.name])
            yield replace(found, restarts=ward.restarts)

    def look(self) -> None:
        """Look at every process once, and do what is to be done about it.

        Raises:
            ProcessFailed: one ended that can never work, or (`RestartsExhausted`) ends too often.
            DeadlineExceeded: a worker did not get ready before the startup clock ran out.
            VersionMismatch, WrongRole: it is no worker to talk to.
        """
        # In the order of their start: render workers come before those that wait for them.
        for ward in self._wards.values():
            if ward.life is not None:
                self._look_at(ward, ward.life)
            elif not ward.over and self._clock() >= ward.due:
                self._begin(ward)
        self._recycle()

    def _begin(self, ward: Ward) -> WorkerProcess:
        process = self._fleet.start(ward.launch)
        _log.info("started %s, as process %d", ward.name, process.pid, extra={"member": ward.name})
        return self._attend(ward, process)

    def _attend(self, ward: Ward, process: WorkerProcess, age: float = 0.0) -> WorkerProcess:
        record = next(record for record in self._fleet.records() if record.name == ward.name)
        now = self._clock()
        ward.life = Life(process, self._pulse(ward, record, process), Watch(ward.patience, now, age), now)
        return process

    def _pulse(self, ward: Ward, record: ProcessRecord, process: WorkerProcess) -> Pulse:
        if ward.is_worker:
            return WorkerPulse(record, self._timeouts)
        return AgentPulse(process, self._registry, self._progress)

    def _look_at(self, ward: Ward, life: Life) -> None:
        if not life.process.is_running:
            self._take_end(ward, life)
            return
        vitals = life.pulse.vitals(waiting=self._waits(ward), stopped=life.process.is_stopped)
        if vitals.ready and not life.ready:
            life.ready = True
            ward.budget.worked()
            seconds = round(self._clock() - life.began, 3)
            _log.info("%s is ready", ward.name, extra={"member": ward.name, "seconds": seconds})
        verdict = life.watch.look(vitals, self._clock())
        if verdict is Verdict.NEVER_READY and ward.is_worker:
            raise DeadlineExceeded(_not_ready(life.process, self._timeouts.startup))
        if verdict is not Verdict.FINE and life.hang is None:
            life.hang = f"{ward.name} {hang_words(verdict, ward.patience)} and was killed (log: {life.process.log})"
            life.process.kill()

    def _waits(self, ward: Ward) -> bool:
        roles = DEPENDS_ON.get(ward.launch.role, frozenset())
        others = (other for other in self._wards.values() if other.launch.role in roles)
        return any(map(self._lacks, roles)) or not all(other.is_ready for other in others)

    def _take_end(self, ward: Ward, life: Life) -> None:
        life.pulse.close()
        ward.life = None
        if self._registry is not None:
            self._registry.forget(ward.name, life.process.pid)
        code = life.process.exit_code
        # Whoever is not our child does not tell us its exit code; what it made does.
        if ward.is_done is not None and code in (ExitCode.DONE, None) and ward.is_done():
            ward.over = True
        elif code == ExitCode.HOPELESS:
            raise ProcessFailed(life.process.obituary())
        elif life.draining is not None:
            # Even if it had to be killed: it was to end anyway.
            self._again(ward, life.draining, pause=0.0, planned=True)
        else:
            self._again(ward, life.hang or life.process.obituary(), self._pause(ward, life), planned=False)

    def _pause(self, ward: Ward, life: Life) -> float:
        pause = ward.budget.charge(self._clock())
        if pause is None:
            reason = life.hang or life.process.obituary()
            raise RestartsExhausted(
                f"{reason}; it was started again {self._config.restarts} times within {self._config.window:g} s already"
            )
        return pause

    def _again(self, ward: Ward, reason: str, pause: float, *, planned: bool) -> None:
        ward.restarts += not planned
        ward.due = self._clock() + pause
        when = f"in {pause:g} s" if pause else "now"
        level = logging.INFO if planned else logging.WARNING
        _log.log(level, "%s; it is started again %s", reason, when, extra={"member": ward.name, "planned": planned})
        self._note(Restart(time=self._wall_clock(), process=ward.name, reason=reason, planned=planned))
        if not pause:
            self._begin(ward)

    def _note(self, restart: Restart) -> None:
        try:
            self._on_restart(restart)
        except OSError as error:
            # A full disk may be the very reason of the restart.
            _log.warning("a restart can't be written down: %s", error)

    def _recycle(self) -> None:
        """Replace a worker that has grown or worked enough; one after the other, while all the others can work."""
        workers = [ward for ward in self._wards.values() if ward.is_worker]
        if not all(ward.life is not None and ward.life.ready and ward.life.draining is None for ward in workers):
            return
        for ward in workers:
            if ward.life is None or not isinstance(ward.life.pulse, WorkerPulse):
                continue
            why = reason_to_recycle(ward.life.pulse.pong, self._config)
            if why is not None:
                ward.life.draining = f"{ward.name} {why} and is replaced"
                ward.life.pulse.drain()
                return


def _not_ready(worker: WorkerProcess, startup: float) -> str:
    words = worker.last_words()
    said = f"; {worker.name} said last: {words}" if words else ""
    return f"{worker.name} did not get ready within {startup:g} s{said} (log: {worker.log})"
