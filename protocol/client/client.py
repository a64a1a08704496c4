"""A client of one worker."""

from typing import Any

from protocol.client.caller import Caller
from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.messages import Pong, Role, Welcome
from protocol.security import LOCAL_ONLY, Security
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts
from protocol.transport.sockets import Context


class Client(Caller):
    """Calls one worker. Connecting, and connecting again to a worker that was restarted, goes on by itself.

    Args:
        address: `tcp://host:port` or `ipc:///path/of/a/socket`.
        role: what this process is.
        serves: what the worker must be; none takes any.
        context: of the process, shared with other sockets; by default the client has its own.
        security: the keys to speak under; without any, only within this machine.

    Raises:
        AddressUnavailable: `address` is none.
        NotPermitted: the keys that there are are not enough to speak with a worker there.
    """

    def __init__(
        self,
        address: str,
        *,
        role: Role,
        serves: Role | None = None,
        timeouts: Timeouts = DEFAULT_TIMEOUTS,
        limits: Limits = DEFAULT_LIMITS,
        context: Context | None = None,
        security: Security = LOCAL_ONLY,
    ) -> None:
        super().__init__(
            [address], role=role, serves=serves, timeouts=timeouts, limits=limits, context=context, security=security
        )
        self.address = address

    def _arguments(self) -> dict[str, Any]:
        return {"address": self.address, **super()._arguments()}

    def wait_ready(self) -> Welcome:
        """Wait until the worker has started.

        Raises:
            DeadlineExceeded: it has not within `timeouts.startup`.
            VersionMismatch, WrongRole: it is not one to talk to.
        """
        return self._wait_ready(self.address, self._startup_ends())

    def ping(self) -> Pong:
        """How the worker is; answered also while it computes."""
        return self._ping(self.address)
