"""The health of a process by its own account: its state, asked by Ping."""

import math
import time
from collections.abc import Callable
from types import TracebackType

import psutil
from msgspec import Struct

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.process_handle import creation_time, has_ended
from protocol.client.client import Client
from protocol.client.pending import Pending
from protocol.errors import CallFailed, ProtocolError
from protocol.messages import AT_WORK, Drain, Ping, Pong, Role, State, WorkerRecord
from protocol.system.process_start import process_start
from protocol.timeouts import Timeouts

NOT_RUNNING = "not running"
SILENT = "silent"
RUNNING = "running"
WAITING = "waiting"
LONGEST_INTERVAL = 0.2
"""Seconds between two pings, or the run's heartbeat if that is shorter."""

_CREATION_VARIES = 2.0
"""Seconds by which the system reports a process's creation differently, since it rounds the time of its boot."""


class Health(Struct, frozen=True, kw_only=True):
    """The last known health of a process.

    Attributes:
        state: as the worker reports it (starting, ready, busy, draining); `waiting` where it lacks workers that it
            needs; `silent` where it does not answer; `running` for a process that serves nothing; or `not running`.
        answered: requests answered so far; None for a process that does not answer pings.
        restarts: how often it was restarted, without planned replacements.
    """

    name: str
    role: Role
    pid: int
    state: str
    answered: int | None = None
    queue_depth: int | None = None
    resident_bytes: int | None = None
    restarts: int = 0

    @classmethod
    def as_registered(cls, record: WorkerRecord) -> "Health":
        """The health of a process that is known by its registration alone; it may be on another machine."""
        state = record.state.value if record.address else RUNNING
        return cls(name=record.name, role=record.role, pid=record.pid, state=state)


class Heartbeat:
    """Pings one process and never waits: each `beat` takes an answer that has come, and sends the next ping when due.

    Args:
        unheard: the state of a process that has not answered yet.

    Attributes:
        pong: its last answer; None before the first.
    """

    def __init__(
        self,
        process: ProcessRecord,
        timeouts: Timeouts,
        unheard: str = SILENT,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._process = process
        self._interval = min(LONGEST_INTERVAL, timeouts.heartbeat)
        self._patience = 2 * timeouts.heartbeat
        self._unheard = unheard
        self._clock = clock
        self._client = (
            Client(process.address, role=Role.ORCHESTRATOR, serves=process.role, timeouts=timeouts)
            if process.address
            else None
        )
        self._pending: Pending[Pong] | None = None
        self._asked = -math.inf
        self._heard = 0.0
        self.pong: Pong | None = None
        self._refusal: ProtocolError | None = None

    def __enter__(self) -> "Heartbeat":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        if self._client is not None:
            self._client.close()

    def beat(self) -> Health:
        """The health of the process, as far as it is known now."""
        if not is_alive(self._process):
            return self._health(NOT_RUNNING)
        if self._client is None:
            return self._health(RUNNING)
        self._take_answer()
        if self._pending is None and self._clock() - self._asked >= self._interval:
            self._asked = self._clock()
            self._pending = self._client.submit(Ping(), deadline=self._patience)
        if self.pong is None:
            return self._health(self._unheard)
        if self._clock() - self._heard > 2 * self._patience:
            return self._health(SILENT)
        waits = self.pong.lacks and self.pong.state in AT_WORK
        return self._health(WAITING if waits else self.pong.state.value, self.pong)

    @property
    def is_ready(self) -> bool:
        """Whether it has reported that it can work."""
        return self.pong is not None and self.pong.state is not State.STARTING

    @property
    def heard(self) -> float | None:
        """When it last answered, in seconds of the clock; None before its first answer."""
        return None if self.pong is None else self._heard

    def drain(self) -> None:
        """Ask the worker to answer its requests in hand, and end."""
        if self._client is not None:
            self._client.submit(Drain())

    def check(self) -> None:
        """Raise `VersionMismatch` or `WrongRole` if it answered with one of these."""
        if self._refusal is not None:
            raise self._refusal

    def _take_answer(self) -> None:
        if self._pending is None or not self._pending.done():
            return
        try:
            self.pong, self._heard = self._pending.result(), self._clock()
        except ProtocolError as error:
            self._refusal = error
        except CallFailed:
            # A failed ping means nothing by itself: once the last answer is old, the process is `silent`.
            self._refusal = None
        self._pending = None

    def _health(self, state: str, pong: Pong | None = None) -> Health:
        return Health(
            name=self._process.name,
            role=self._process.role,
            pid=self._process.pid,
            state=state,
            answered=pong.progress if pong else None,
            queue_depth=pong.queue_depth if pong else None,
            resident_bytes=pong.resident_bytes if pong else None,
        )


def is_alive(process: ProcessRecord) -> bool:
    """Whether the recorded process runs, and not a later one with the same id."""
    try:
        return _is_its_number(process) and not has_ended(psutil.Process(process.pid))
    except psutil.NoSuchProcess:
        return False


def _is_its_number(process: ProcessRecord) -> bool:
    """Whether the recorded process still has its id, at least as a zombie."""
    if process.started_at is not None:
        return process_start(process.pid) == process.started_at
    return abs(creation_time(process.pid) - process.started) < _CREATION_VARIES
