"""One ping to a process."""

from contextlib import closing

from orchestrator.run.process_record import ProcessRecord
from protocol.client.client import Client
from protocol.errors import VantageError
from protocol.messages import Ping, Pong, Role

PATIENCE = 2.0
"""Seconds; callers ping again."""


def answers(process: ProcessRecord) -> bool:
    """Whether a server at the process's address answers pings; it need not be ready."""
    return ping(process) is not None


def ping(process: ProcessRecord) -> Pong | None:
    """The answer of the process; None where it does not answer, or serves nothing."""
    if not process.address:
        return None
    with closing(Client(process.address, role=Role.ORCHESTRATOR, serves=process.role)) as client:
        try:
            return client.call(Ping(), deadline=PATIENCE)
        except VantageError:
            return None
