"""Every fault class, by name."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeAlias

from orchestrator.chaos.scenarios.checkpoint_kills import PLACES, KillAtCheckpoint
from orchestrator.chaos.scenarios.full_disk import CAN_FILL_DISKS, FullDisk
from orchestrator.chaos.scenarios.intrusions import garbage, oversized
from orchestrator.chaos.scenarios.kills import KillOrchestrator, KillProcess
from orchestrator.chaos.scenarios.late_replies import LateReply
from orchestrator.chaos.scenarios.quick_restart import RestartWithinAPing
from orchestrator.chaos.scenarios.scenario import Scenario
from orchestrator.chaos.scenarios.stops import StopOrchestrator, StopProcess
from protocol.errors import InvalidInput
from protocol.messages import Role

MakeScenario: TypeAlias = Callable[[float], Scenario]
"""Makes a scenario from a number in [0, 1), for its random choices."""


OF_WORKERS = {
    *(f"{fault}-{role.value}" for fault in ("kill", "stop", "late") for role in (Role.RENDER, Role.PERCEPTION)),
    "restart-within-a-ping",
}
"""The scenarios that hurt a worker; a run on the grid has none."""


def catalogue(*, workers: bool = True) -> dict[str, MakeScenario]:
    """All scenarios that are possible on this machine, and in a run with or without workers."""
    hurt = (Role.RENDER, Role.PERCEPTION, Role.AGENT)
    made: dict[str, MakeScenario] = {f"kill-{role.value}": partial(KillProcess, role) for role in hurt}
    made |= {"kill-orchestrator": KillOrchestrator}
    made |= {f"stop-{role.value}": partial(StopProcess, role) for role in hurt}
    made |= {
        "stop-orchestrator": StopOrchestrator,
        "restart-within-a-ping": _restart_within_a_ping,
        "garbage": garbage,
        "oversized": oversized,
        "late-render": lambda _: LateReply(Role.RENDER),
        "late-perception": lambda _: LateReply(Role.PERCEPTION),
    }
    if CAN_FILL_DISKS:
        made["full-disk"] = FullDisk
    made |= {f"kill-at-{place}": _at_checkpoint(place) for place in PLACES}
    return made if workers else {name: make for name, make in made.items() if name not in OF_WORKERS}


def chosen(names: tuple[str, ...], *, workers: bool = True) -> Mapping[str, MakeScenario]:
    """The scenarios of these names, or all without any name.

    Raises:
        InvalidInput: there is no scenario of a name, or it hurts a worker and the run has none.
    """
    known = catalogue(workers=workers)
    for name in names:
        if name not in known:
            raise InvalidInput(f"there is no fault class '{name}'; there are {', '.join(known)}")
    return {name: known[name] for name in names or known}


def _at_checkpoint(place: str) -> MakeScenario:
    return lambda _: KillAtCheckpoint(place)


def _restart_within_a_ping(chance: float) -> Scenario:
    # Both halves of `chance` are spread over [0, 1) again, for which of several workers it is.
    role = Role.RENDER if chance < 0.5 else Role.PERCEPTION
    return RestartWithinAPing(role, 2 * chance % 1.0)
