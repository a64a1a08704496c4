"""Access control of a worker with keys: it authenticates clients, checks their requests, and logs refusals."""

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
    """Guards a worker's socket. `attach`, `read_events` and `detach` belong to the socket's thread."""

    def __init__(self, credentials: Credentials) -> None:
        self.credentials = credentials
        self.refusals = Refusals()
        self._monitor: HandshakeMonitor | None = None

    def attach(self, socket: "Socket") -> None:
        """Begin to monitor the handshakes on a socket."""
        self._monitor = HandshakeMonitor(socket, self.refusals)

    @property
    def monitors(self) -> "tuple[Socket, ...]":
        """The sockets to wait on for `read_events`."""
        return () if self._monitor is None else (self._monitor.monitor,)

    def read_events(self) -> None:
        """Log the handshakes that failed since the last call."""
        if self._monitor is not None:
            self._monitor.read_events()

    def detach(self) -> None:
        """Stop monitoring."""
        if self._monitor is not None:
            self._monitor.close()
            self._monitor = None

    def objection(self, key: str, address: str, message: object) -> str | None:
        """Why a message from the holder of `key` is refused, which is logged as well; None if it is allowed.

        Checked for each message, since a key may be revoked while its connection stands.

        Args:
            key: the public key that the sender has proved.
            address: the sender's IP address.
        """
        role = self.credentials.role_of(key)
        reason = "its key was revoked" if role is None else objection(message, role)
        if reason is not None:
            self.refusals.note(address, reason)
        return None if reason is None else f"refused: {reason}"


@contextmanager
def guard_of(context: "Context", role: Role, credentials: Credentials | None) -> Generator[Guard | None]:
    """Yield a guard for a worker's socket in a context of its own; None without credentials."""
    if credentials is None:
        yield None
        return
    guard = Guard(credentials)
    with guarded(context, role, credentials, guard.refusals):
        yield guard
