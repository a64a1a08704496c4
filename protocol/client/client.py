"""A client of one worker."""

from typing import Any

from protocol.client.caller import Caller
from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.messages import Pong, Role, Welcome
from protocol.security import LOCAL_ONLY, Security
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts
from protocol.transport.sockets import Context


class Client(Caller):
    """Calls one worker. The client connects by itself, and reconnects to a worker that was restarted.

    >>> from protocol import Client
    >>> from protocol.messages import Role, SampleScene
    >>> with Client("ipc://render-0", role=Role.AGENT, serves=Role.RENDER) as renderer:
    ...     renderer.wait_ready().role.value
    ...     scene = renderer.call(SampleScene(seed=7, split="train")).scene
    'render'

    Args:
        address: `tcp://host:port` or `ipc:///path/of/a/socket`.
        role: the role of this process.
        serves: the role that the worker must have; None for any.
        context: the process's ZeroMQ context, to share it with other sockets; by default the client has its own.
        security: the keys of this process; without keys it calls only workers on this machine.

    Raises:
        AddressUnavailable: `address` is not an address.
        NotPermitted: `security` has no key that a worker at `address` may be called with.
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
            DeadlineExceeded: it did not start within `timeouts.startup`.
            VersionMismatch: it shares no version of the protocol with this process.
            WrongRole: it serves another role.
        """
        return self._wait_ready(self.address, self._startup_ends())

    def ping(self) -> Pong:
        """The worker's state; it answers also while a handler computes."""
        return self._ping(self.address)
