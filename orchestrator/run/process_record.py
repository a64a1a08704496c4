"""The processes of a run, as they were started."""

from msgspec import Struct

from protocol.messages import Role
from protocol.system.process_start import ProcessStart


class ProcessRecord(Struct, frozen=True, kw_only=True):
    """A process of the run as it was started: a line of `workers.json`.

    Attributes:
        address: where it serves; None for the agent, which serves nothing.
        started: its creation in seconds since 1970, by the wall clock as it was set then; for display.
        started_at: the same on a clock that is never set, which tells it from a later process with the same id; None in
            records of older versions.
        log: its log, relative to the run directory.
        log_start: the byte there at which its own lines begin.
    """

    name: str
    role: Role
    address: str | None
    pid: int
    started: float
    log: str
    log_start: int = 0
    started_at: ProcessStart | None = None

    @property
    def identity(self) -> tuple[int, ProcessStart | float]:
        """What identifies the process: its id and its start."""
        return self.pid, self.started if self.started_at is None else self.started_at
