"""What a client makes of a worker's answer to its `Hello`."""

from protocol.errors import MalformedMessage, NotPermitted, ProtocolError, VantageError, VersionMismatch, WrongRole
from protocol.failure import error_of
from protocol.message import Reply
from protocol.messages import OLDEST_PROTOCOL_VERSION, PROTOCOL_VERSION, Failure, Role, Welcome
from protocol.security import Curve


def name_of(address: str, serves: Role | None) -> str:
    """What a worker is called for people, who is to serve a role, or any."""
    return f"{serves or 'worker'} at {address}"


def objection(reply: Reply | ProtocolError, address: str, serves: Role | None) -> VantageError | None:
    """Why no call can be made to the worker at an address after this answer; None where calls can."""
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
    """What to tell calls to a worker that did not take our key."""
    ours = "" if curve is None else f" {curve.own.name!r}"
    return NotPermitted(
        f"{name} does not take our key{ours}: it is not in its list of allowed keys, was revoked, or is of "
        "a role that has no business there; its log says which"
    )
