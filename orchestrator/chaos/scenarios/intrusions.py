"""Intruders at every socket of a run."""

import random
from collections.abc import Callable

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.intruder import (
    garbage_messages,
    garbage_talks,
    oversized_messages,
    oversized_talks,
    send_messages,
    talk,
)
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.pings import ping
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.run.process_record import ProcessRecord


class Intrusion(Scenario):
    """An intruder connects to every socket, the orchestrator's included.

    Setup: every server answers pings.
    Fault: the intruder sends each of them malformed messages.
    Recovery: each answers pings, and has counted the malformed messages.
    Invariant: all are the same processes.

    Args:
        intrude: attacks the server at an address.
    """

    def __init__(self, intrude: Callable[[str], None]) -> None:
        self._intrude = intrude

    def setup(self, run: RehearsedRun) -> None:
        """Note the processes, and the malformed messages that each has counted."""
        self._all = run.children.alive()
        run.wait(lambda: all(ping(process) for process in serving(run)), "every socket answered")
        self._malformed = {process.name: _malformed(process) for process in serving(run)}

    def fault(self, run: RehearsedRun) -> float:
        """Attack each socket."""
        begun = run.now()
        for process in serving(run):
            self._intrude(str(process.address))
        return begun

    def recovered(self, run: RehearsedRun) -> bool:
        """Whether all servers answer, and have counted malformed messages."""
        return all(_malformed(process) > self._malformed[process.name] for process in serving(run))

    def invariant(self, run: RehearsedRun) -> None:
        """Malformed messages end no process."""
        require_unhurt(self._all, by="an intruder's messages")
        if run.orchestrator_pid is None:
            raise InvariantBroken("the orchestrator did not survive an intruder's messages")


def garbage(chance: float) -> Intrusion:
    """An intrusion by random bytes and malformed messages."""
    rng = random.Random(chance)

    def intrude(address: str) -> None:
        send_messages(address, garbage_messages(rng))
        talk(address, garbage_talks(rng))

    return Intrusion(intrude)


def oversized(_chance: float) -> Intrusion:
    """An intrusion by messages beyond every limit."""

    def intrude(address: str) -> None:
        send_messages(address, oversized_messages())
        talk(address, oversized_talks())

    return Intrusion(intrude)


def serving(run: RehearsedRun) -> tuple[ProcessRecord, ...]:
    """The processes that serve, the orchestrator included."""
    return (*(process for process in run.children.alive() if process.address), run.orchestrator_record())


def _malformed(process: ProcessRecord) -> int:
    pong = ping(process)
    return pong.malformed if pong else -1
