"""Decides for each client that connects whether its key is allowed here.

ZeroMQ asks by its authentication protocol (ZAP, RFC 27) over a socket within the process. pyzmq answers in a thread,
and asks the `ZapAuthenticator`. A client without a valid key fails earlier, in ZeroMQ's own handshake: see
`protocol.security.handshake_monitor`.
"""

import logging
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from zmq.auth.thread import ThreadAuthenticator

from protocol.messages import Role
from protocol.security.credentials import Credentials
from protocol.security.permissions import MAY_CALL
from protocol.security.refusals import Refusals

if TYPE_CHECKING:
    from protocol.transport.sockets import Context

_silent = logging.getLogger(f"{__name__}.zap")
_silent.setLevel(logging.CRITICAL)


class _AddressedAuthenticator(ThreadAuthenticator):
    """pyzmq's authenticator, which also passes on the client's IP address."""

    def __init__(self, context: "Context", admits: Callable[[str, str], bool]) -> None:
        super().__init__(context, log=_silent)  # pyright: ignore[reportUnknownMemberType]
        self._admits = admits
        self._address = ""
        self.configure_curve_callback(domain="*", credentials_provider=self)

    async def handle_zap_message(self, msg: list[bytes]) -> None:
        """Answer one request; `callback` is called meanwhile."""
        self._address = msg[3].decode("ascii", "replace") if len(msg) > 3 else ""
        await super().handle_zap_message(msg)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether the holder of a public key may connect."""
        return self._admits(key.decode("ascii"), self._address)


class ZapAuthenticator:
    """Decides by their keys which clients may call a worker of a role; every refusal is logged."""

    def __init__(self, role: Role, credentials: Credentials, refusals: Refusals) -> None:
        self._role = role
        self._credentials = credentials
        self._refusals = refusals

    def admits(self, key: str, address: str) -> bool:
        """Whether a client at an IP address that has proved to hold the public key `key` may connect."""
        reason = self._objection(key)
        if reason is not None:
            self._refusals.note(address, reason)
        return reason is None

    def _objection(self, key: str) -> str | None:
        found = self._credentials.find(key)
        if found is None:
            return f"its key {key} is not in the list of allowed keys"
        if found.revoked:
            return f"its key {found.name!r} was revoked"
        if found.role not in MAY_CALL[self._role]:
            return f"its key {found.name!r} is of the role {found.role}, which may not call {self._role}"
        return None


@contextmanager
def guarded(context: "Context", role: Role, credentials: Credentials, refusals: Refusals) -> Generator[None]:
    """While inside, a `ZapAuthenticator` of the role decides for all sockets of the context that have keys."""
    authenticator = _AddressedAuthenticator(context, ZapAuthenticator(role, credentials, refusals).admits)
    authenticator.start()
    try:
        yield
    finally:
        authenticator.stop()
