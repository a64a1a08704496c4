"""A supervised launch and its processes, one after the other."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from orchestrator.supervision.hang_detector import HangDetector, Patience, Verdict
from orchestrator.supervision.health_probe import HealthProbe
from orchestrator.supervision.launch import Launch
from orchestrator.supervision.restart_budget import RestartBudget
from orchestrator.supervision.worker_process import WorkerProcess
from protocol.messages import Role
from protocol.timeouts import Timeouts

DEPENDS_ON: dict[Role, frozenset[Role]] = {
    Role.PERCEPTION: frozenset({Role.RENDER}),
    Role.AGENT: frozenset({Role.RENDER, Role.PERCEPTION}),
}
"""The roles of the workers that a process of each role needs."""

IsDone: TypeAlias = Callable[[], bool]
"""Whether the output of a process exists, as its record on disk says."""


@dataclass(slots=True, eq=False)
class RunningProcess:
    """The process that runs for a launch, from its start to its end.

    Attributes:
        began: seconds of the supervisor's clock.
        ready: whether it was ready at any poll.
        draining: why it was asked to end for a replacement; None where it was not.
        hang: why it was killed; None where it was not.
    """

    process: WorkerProcess
    health_probe: HealthProbe
    hang_detector: HangDetector
    began: float
    ready: bool = False
    draining: str | None = None
    hang: str | None = None


@dataclass(slots=True, eq=False)
class SupervisedProcess:
    """A launch, its restart budget, and the process that runs for it now.

    Attributes:
        is_done: for an agent, which ends when its work is done; None for a worker, which serves until it is stopped.
        running: None between an exit and the restart.
        due: when to restart it, in seconds of the supervisor's clock.
        over: whether its work is done.
        restarts: so far, without planned replacements.
    """

    launch: Launch
    budget: RestartBudget
    patience: Patience
    is_done: IsDone | None
    restarts: int
    running: RunningProcess | None = None
    due: float = 0.0
    over: bool = False

    @property
    def name(self) -> str:
        """The launch's name."""
        return self.launch.name

    @property
    def is_worker(self) -> bool:
        """Whether it serves requests."""
        return self.is_done is None

    @property
    def is_ready(self) -> bool:
        """Whether its process can work, as far as is known."""
        return self.running is not None and self.running.ready


def patience_with(role: Role, timeouts: Timeouts) -> Patience:
    """The clocks of a process of a role."""
    match role:
        case Role.AGENT:
            return Patience.of_agent(timeouts)
        case Role.PERCEPTION:
            return Patience.of_perception(timeouts)
        case _:
            return Patience.of_render(timeouts)


def hang_words(verdict: Verdict, patience: Patience) -> str:
    """How a process hangs, as words to follow its name."""
    match verdict:
        case Verdict.SILENT:
            return f"hung (silent for {patience.liveness:g} s)"
        case Verdict.STUCK:
            return f"hung (made no progress for {patience.progress:g} s with requests in hand)"
        case _:
            return f"did not get ready within {patience.startup:g} s"
