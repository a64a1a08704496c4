"""The standings of the processes that a run needs, by role."""

from collections.abc import Mapping

from orchestrator.monitoring.live_display import Snapshot
from orchestrator.supervision.heartbeat import RUNNING
from protocol.client.diagnosis import Standing
from protocol.messages import Role, State

_NEEDED = (Role.RENDER, Role.PERCEPTION, Role.AGENT)
_AT_WORK = frozenset({State.READY.value, State.BUSY.value, RUNNING})


def standings_by_role(snapshot: Snapshot) -> Mapping[Role, tuple[Standing, ...]]:
    """The standing of each process that a run needs, by role."""
    return {
        role: tuple(
            Standing(address=one.name, at_work=one.state in _AT_WORK, reason="" if one.state in _AT_WORK else one.state)
            for one in snapshot.workers
            if one.role is role
        )
        for role in _NEEDED
    }
