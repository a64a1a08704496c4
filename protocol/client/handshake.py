"""The handshake with a worker: a `Hello`, and what the answer to it means for calls."""

from protocol.errors import MalformedMessage, NotPermitted, ProtocolError, VantageError, VersionMismatch, WrongRole
from protocol.failure import error_of
from protocol.message import Reply
from protocol.messages import OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, Failure, Role, Welcome
from protocol.security import Curve

_LONGEST_HEARTBEAT = 10.0


class Handshake:
    """What a client knows from its last handshake with the worker at an address.

    Args:
        serves: the role that the worker must have; None for any.
        curve: the keys that the client connects with; None without keys.

    Attributes:
        name: of the worker, for messages.
        incarnation: of the worker that answered; empty before.
    """

    def __init__(self, address: str, serves: Role | None, curve: Curve | None) -> None:
        self.name = name_of(address, serves)
        self.incarnation = ""
        self._address = address
        self._serves = serves
        self._curve = curve
        self._answer: Reply | ProtocolError | None = None
        self._denial: NotPermitted | None = None

    @property
    def refusal(self) -> VantageError | None:
        """Why no call can be made to the worker; None if calls can be made, or before an answer."""
        return self._denial if self._answer is None else objection(self._answer, self._address, self._serves)

    @property
    def is_denied(self) -> bool:
        """Whether the worker did not take our key."""
        return self._denial is not None

    def heartbeat(self, own: float) -> float:
        """Seconds between two pings: the longer of both sides' intervals.

        The worker's counts up to ten seconds, since what it sends may be anything, even NaN.
        """
        wished = self._answer.heartbeat if isinstance(self._answer, Welcome) else 0.0
        return max(own, min(wished, _LONGEST_HEARTBEAT))

    def begin(self) -> None:
        """The socket is connected, so the worker took our key."""
        self._denial = None

    def deny(self) -> None:
        """The worker did not take our key. That stays the refusal until a later try succeeds."""
        self._denial = denial(self.name, self._curve)

    def end(self, answer: Reply | ProtocolError, incarnation: str) -> None:
        """The worker answered `Hello`."""
        self._answer = answer
        self.incarnation = incarnation

    def forget(self) -> None:
        """The connection broke: the next one needs a handshake of its own."""
        self._answer = None


def name_of(address: str, serves: Role | None) -> str:
    """What messages call the worker at an address that has to serve a role, or any role."""
    return f"{serves or 'worker'} at {address}"


def objection(reply: Reply | ProtocolError, address: str, serves: Role | None) -> VantageError | None:
    """Why no call can be made to the worker at an address after this answer; None if calls can be made."""
    name = name_of(address, serves)
    if isinstance(reply, ProtocolError):
        return reply
    if isinstance(reply, Failure):
        return error_of(reply, name, "Hello")
    if not isinstance(reply, Welcome):
        return MalformedMessage(f"{name} answered Hello with {type(reply).__name__}")
    if not OLDEST_PROTOCOL_VERSION <= reply.version <= PROTOCOL_VERSION:
        return VersionMismatch(
            f"{name} wants version {reply.version} of the protocol; "
            f"this process speaks {OLDEST_PROTOCOL_VERSION} to {PROTOCOL_VERSION}"
        )
    if serves is not None and reply.role is not serves:
        return WrongRole(f"the worker at {address} serves {reply.role}, not {serves}; check the addresses")
    return None


def denial(name: str, curve: Curve | None) -> NotPermitted:
    """The error of calls to a worker that did not take our key."""
    ours = "" if curve is None else f" {curve.own.name!r}"
    return NotPermitted(
        f"{name} does not take our key{ours}: the key is not in the worker's list of allowed keys, was revoked, or "
        "has a role that may not call this worker; the worker's log says which"
    )
