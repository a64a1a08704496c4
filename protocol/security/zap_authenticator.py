"""Asks of everybody who connects whether their key is allowed here.

ZeroMQ asks by its authentication protocol (ZAP, RFC 27) over a socket within the process; pyzmq answers it from a
thread, and asks us. Whoever has no key that fits fails before that, in ZeroMQ's own handshake: see
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


class _Authenticator(ThreadAuthenticator):
    """pyzmq's, which also tells from where somebody knocks."""

    def __init__(self, context: "Context", admits: Callable[[str, str], bool]) -> None:
        super().__init__(context, log=_silent)  # pyright: ignore[reportUnknownMemberType]
        self._admits = admits
        self._address = ""
        self.configure_curve_callback(domain="*", credentials_provider=self)

    async def handle_zap_message(self, msg: list[bytes]) -> None:
        """Answer one question; `callback` is called within."""
        self._address = msg[3].decode("ascii", "replace") if len(msg) > 3 else ""
        await super().handle_zap_message(msg)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether the holder of a public key may come in."""
        return self._admits(key.decode("ascii"), self._address)


class ZapAuthenticator:
    """Who may call a worker of a role, by their key; every refusal is written down."""

    def __init__(self, role: Role, credentials: Credentials, refusals: Refusals) -> None:
        self._role = role
        self._credentials = credentials
        self._refusals = refusals

    def admits(self, key: str, address: str) -> bool:
        """Whether somebody who has proved to hold `key`, at `address`, may connect."""
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
            return f"its key {found.name!r} is of the role {found.role}, which has no business with {self._role}"
        return None


@contextmanager
def guarded(context: "Context", role: Role, credentials: Credentials, refusals: Refusals) -> Generator[None]:
    """Have all sockets of a context that ask for keys ask a gatekeeper of the role."""
    authenticator = _Authenticator(context, ZapAuthenticator(role, credentials, refusals).admits)
    authenticator.start()
    try:
        yield
    finally:
        authenticator.stop()
