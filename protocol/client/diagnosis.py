"""Why a call got no answer or would get none, in words that say what to do."""

from collections.abc import Sequence

from msgspec import Struct

from protocol.client.call import Call
from protocol.client.connection import Connection, Phase
from protocol.errors import CallFailed, DeadlineExceeded, WorkerLost
from protocol.messages import State

_STATUS = "See 'orchestrator status'"


class Standing(Struct, frozen=True, kw_only=True):
    """A worker as its client knows it.

    Attributes:
        at_work: whether it is there, handles requests, and has whoever it needs for that.
        reason: why not; empty where it does.
    """

    address: str
    at_work: bool
    reason: str = ""


def standing(connection: Connection) -> Standing:
    """How the worker behind a connection stands."""
    if connection.is_at_work and not connection.lacks:
        return Standing(address=connection.address, at_work=True)
    return Standing(address=connection.address, at_work=False, reason=_absence(connection))


def _absence(connection: Connection) -> str:
    """Why a worker that is not at work is not."""
    refusal, pong = connection.refusal, connection.health
    if connection.phase is Phase.REFUSED and refusal is not None:
        return str(refusal)
    if connection.phase is Phase.GREETING:
        return "it took the connection and has not said Welcome yet"
    if connection.phase is not Phase.OPEN:
        return "there is no connection to it"
    if connection.suspicion is not None:
        return str(connection.suspicion)
    if connection.lacks:
        return f"it waits for {' and '.join(connection.lacks)}"
    return "it has not said how it is yet" if pong is None else f"it is {pong.state}"


def expiry(call: Call, connections: Sequence[Connection], now: float) -> CallFailed:
    """The error of a call whose deadline has come; `connections` are those that it could be made on."""
    if not connections:
        return DeadlineExceeded(
            f"no worker is known that could answer {call.request}, and none came within {call.timeout:.3g} s; "
            f"is one running? {_STATUS}"
        )
    holder = next((one for one in connections if call in one.outstanding.values()), None)
    tries = f"{call.tries} {'try' if call.tries == 1 else 'tries'}"
    last = f"; the last one failed: {call.trouble}" if call.trouble else ""
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
    return refused[0] if len(refused) == len(greeted) else _health(greeted[0], now)


def _health(connection: Connection, now: float) -> str:
    pong = connection.health
    if pong is None or connection.heard is None:
        return f"it has not answered a ping since it was connected. {_STATUS}"
    if pong.state is State.STARTING:
        return "it is still starting; allow it more time (timeouts.startup)"
    if connection.suspicion is not None:
        return f"{connection.suspicion}, and was heard {now - connection.heard:.1f} s ago; does it hang? {_STATUS}"
    return (
        f"it was heard {now - connection.heard:.1f} s ago, {pong.state}, with {pong.queue_depth} requests in hand "
        f"and {pong.progress} answered; allow it more time (timeouts.call) or start more workers. {_STATUS}"
    )
