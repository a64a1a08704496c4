"""A worker that is replaced between two pings, so that pings alone do not reveal that its requests are lost."""

import signal
import time

from orchestrator.chaos.errors import InvariantBroken
from orchestrator.chaos.rehearsed_run import RehearsedRun
from orchestrator.chaos.scenarios.children import send
from orchestrator.chaos.scenarios.invariants import require_unhurt
from orchestrator.chaos.scenarios.pings import answers
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.run.process_record import ProcessRecord
from protocol.messages import Role

TRIES = 3
"""A busy machine may take longer than a ping interval to start a process; then the fault is repeated."""


class RestartWithinAPing(Scenario):
    """A worker is replaced before its next ping.

    Setup: workers and an agent run.
    Fault: a worker is killed, and its successor answers at the same address before the next ping was due.
    Recovery: the training continues.
    Invariant: the replacement was that quick, and no other process was replaced.
    """

    def __init__(self, role: Role, chance: float) -> None:
        self._role = role
        self._chance = chance
        self._absence = 0.0

    def setup(self, run: RehearsedRun) -> None:
        """Note the other processes."""
        run.member(self._role, self._chance)
        self._others = tuple(process for process in run.children.alive() if process.role is not self._role)

    def fault(self, run: RehearsedRun) -> float:
        """Kill the worker, and again if its successor was not quick enough."""
        killed = run.now()
        for _ in range(TRIES):
            victim = run.member(self._role, self._chance)
            killed = self._kill(victim, run)
            if self._absence <= run.timeouts.heartbeat:
                break
        return killed

    def invariant(self, run: RehearsedRun) -> None:
        """The successor answered within a ping interval, and no other process was replaced."""
        require_unhurt(self._others, by=f"the quick restart of a {self._role.value} worker")
        if self._absence > run.timeouts.heartbeat:
            raise InvariantBroken(
                f"no successor of a {self._role.value} worker answered within a ping interval of "
                f"{run.timeouts.heartbeat:g} s, the last one within {self._absence:.1f} s"
            )

    def _kill(self, victim: ProcessRecord, run: RehearsedRun) -> float:
        begun = time.monotonic()
        send(victim, signal.SIGKILL)
        killed = run.now()
        run.wait(lambda: run.successor(victim) is not None, f"a successor of {victim.name} was started")
        run.wait(lambda: answers(victim), f"a successor of {victim.name} answered")
        self._absence = time.monotonic() - begun
        return killed
