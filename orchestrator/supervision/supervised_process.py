"""One process in the supervisor's care, over all the times that it is started."""

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
"""Whom a process of each role can't do without."""

IsDone: TypeAlias = Callable[[], bool]
"""Whether what a process was to make is there, as the record of it says."""


@dataclass(slots=True, eq=False)
class Life:
    """One life of a supervised process, from its start to its end.

    Attributes:
        began: in seconds of the supervisor's clock.
        ready: it was, at some look.
        draining: why it was asked to end for a replacement, if it was.
        hang: why it was killed, if it was.
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
    """A launch, how often it may be started again, and the process that stands for it now.

    Attributes:
        is_done: for an agent, which ends when its work is done; a worker never does.
        life: None while none runs.
        due: when it is to be started again, in seconds of the supervisor's clock.
        over: its work is done.
        restarts: so far, replacements not counted.
    """

    launch: Launch
    budget: RestartBudget
    patience: Patience
    is_done: IsDone | None
    restarts: int
    life: Life | None = None
    due: float = 0.0
    over: bool = False

    @property
    def name(self) -> str:
        """The launch's name."""
        return self.launch.name

    @property
    def is_worker(self) -> bool:
        """Whether it serves."""
        return self.is_done is None

    @property
    def is_ready(self) -> bool:
        """Whether its process can work, as far as is known."""
        return self.life is not None and self.life.ready


def patience_with(role: Role, timeouts: Timeouts) -> Patience:
    """How long a process of a role may take for what."""
    match role:
        case Role.AGENT:
            return Patience.of_agent(timeouts)
        case Role.PERCEPTION:
            return Patience.of_perception(timeouts)
        case _:
            return Patience.of_render(timeouts)


def hang_words(verdict: Verdict, patience: Patience) -> str:
    """How a process hangs, to follow its name."""
    match verdict:
        case Verdict.SILENT:
            return f"hung (not heard of for {patience.liveness:g} s)"
        case Verdict.STUCK:
            return f"hung (got nothing done for {patience.progress:g} s, with work in hand)"
        case _:
            return f"did not get ready within {patience.startup:g} s"
