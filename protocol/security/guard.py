"""All that a worker with keys does about who calls it."""

from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from protocol.messages import Role
from protocol.security.credentials import Credentials
from protocol.security.handshake_monitor import HandshakeMonitor
from protocol.security.permissions import objection
from protocol.security.refusals import Refusals
from protocol.security.zap_authenticator import guarded

if TYPE_CHECKING:
    from protocol.transport.sockets import Context, Socket


class Guard:
    """Looks after a worker's socket. `attach`, `look` and `detach` belong to the socket's thread."""

    def __init__(self, credentials: Credentials) -> None:
        self.credentials = credentials
        self.refusals = Refusals()
        self._monitor: HandshakeMonitor | None = None

    def attach(self, socket: "Socket") -> None:
        """Watch who knocks at a socket."""
        self._monitor = HandshakeMonitor(socket, self.refusals)

    @property
    def monitors(self) -> "tuple[Socket, ...]":
        """What to wait on for `look`."""
        return () if self._monitor is None else (self._monitor.monitor,)

    def look(self) -> None:
        """Take in who has knocked since the last time."""
        if self._monitor is not None:
            self._monitor.look()

    def detach(self) -> None:
        """Watch no more."""
        if self._monitor is not None:
            self._monitor.close()
            self._monitor = None

    def objection(self, key: str, address: str, message: object) -> str | None:
        """Why a message of somebody who proved to hold `key` is refused, which is written down; None if it is fine.

        Asked for each message, since a key may be revoked while its connection stands.
        """
        role = self.credentials.role_of(key)
        reason = "its key was revoked" if role is None else objection(message, role)
        if reason is not None:
            self.refusals.note(address, reason)
        return None if reason is None else f"refused: {reason}"


@contextmanager
def guard_of(context: "Context", role: Role, credentials: Credentials | None) -> Generator[Guard | None]:
    """A guard for a worker's socket in a context of its own; none where no key is needed."""
    if credentials is None:
        yield None
        return
    guard = Guard(credentials)
    with guarded(context, role, credentials, guard.refusals):
        yield guard
