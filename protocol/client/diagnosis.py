"""Why a call got no answer, or would get none, as a sentence that says what to do."""

from collections.abc import Sequence

from msgspec import Struct

from protocol.client.call import Call
from protocol.client.connection import Connection, Phase
from protocol.client.worker_health import WorkerHealth
from protocol.errors import CallFailed, DeadlineExceeded, WorkerLost
from protocol.messages import State

_STATUS = "See 'orchestrator status'"


class Standing(Struct, frozen=True, kw_only=True):
    """A worker as its client knows it.

    Attributes:
        at_work: whether the worker is connected, handles requests, and has the workers that it needs for them.
        reason: why it is not at work; empty if it is.
    """

    address: str
    at_work: bool
    reason: str = ""


def standing(connection: Connection) -> Standing:
    """How the worker behind a connection stands."""
    if connection.is_at_work and not connection.health.lacks:
        return Standing(address=connection.address, at_work=True)
    return Standing(address=connection.address, at_work=False, reason=_absence(connection))


def _absence(connection: Connection) -> str:
    """Why a worker is not at work."""
    refusal, health = connection.refusal, connection.health
    if connection.phase is Phase.REFUSED and refusal is not None:
        return str(refusal)
    if connection.phase is Phase.GREETING:
        return "it took the connection and has not said Welcome yet"
    if connection.phase is not Phase.OPEN:
        return "there is no connection to it"
    if health.suspicion is not None:
        return str(health.suspicion)
    if health.lacks:
        return f"it waits for {' and '.join(health.lacks)}"
    return "it has not answered a ping yet" if health.pong is None else f"it is {health.pong.state}"


def expiry(call: Call, connections: Sequence[Connection], now: float) -> CallFailed:
    """The error of a call whose deadline has passed; `connections` are those on which it could be made."""
    if not connections:
        return DeadlineExceeded(
            f"no worker is known that could answer {call.request}, and none came within {call.timeout:.3g} s; "
            f"is one running? {_STATUS}"
        )
    holder = next((one for one in connections if call in one.held), None)
    tries = f"{call.tries} {'try' if call.tries == 1 else 'tries'}"
    last = f"; the last one failed: {call.last_error}" if call.last_error else ""
    if call.losses and holder is None:
        return WorkerLost(
            f"{_names(connections)} was lost while it held {call.request}, and none took it "
            f"within {call.timeout:.3g} s ({tries}{last}); {_hint(connections, now)}"
        )
    who = _names(connections) if holder is None else holder.name
    asked = connections if holder is None else [holder]
    return DeadlineExceeded(
        f"{who} did not answer {call.request} within {call.timeout:.3g} s ({tries}{last}); {_hint(asked, now)}"
    )


def _names(connections: Sequence[Connection]) -> str:
    return " or ".join(connection.name for connection in connections)


def _hint(connections: Sequence[Connection], now: float) -> str:
    connected = [one for one in connections if one.phase is not Phase.CONNECTING]
    if not connected:
        return f"is it running? {_STATUS}"
    greeted = [one for one in connected if one.phase is not Phase.GREETING]
    if not greeted:
        return "it took the connection and never said Welcome; is it a Vantage worker?"
    refused = [str(one.refusal) for one in greeted if one.refusal is not None]
    return refused[0] if len(refused) == len(greeted) else _health(greeted[0].health, now)


def _health(health: WorkerHealth, now: float) -> str:
    pong = health.pong
    if pong is None or health.heard is None:
        return f"it has not answered a ping since it was connected. {_STATUS}"
    if pong.state is State.STARTING:
        return "it is still starting; allow it more time (timeouts.startup)"
    silence = now - health.heard
    if health.suspicion is not None:
        return f"{health.suspicion}, and was heard {silence:.1f} s ago; does it hang? {_STATUS}"
    return (
        f"it was heard {silence:.1f} s ago, {pong.state}, with {pong.queue_depth} requests in hand "
        f"and {pong.progress} answered; allow it more time (timeouts.call) or start more workers. {_STATUS}"
    )
