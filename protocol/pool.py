"""A client of several workers that serve the same role."""

from collections.abc import Sequence

from protocol.caller import Caller
from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.messages import Pong, Role, Welcome
from protocol.sockets import Context
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts


class Pool(Caller):
    """Spreads calls over workers: each goes to the ready one with the fewest in hand.

    What a lost worker held goes to another at once. Arguments and errors are `Client`'s.
    """

    def __init__(
        self,
        addresses: Sequence[str],
        *,
        role: Role,
        serves: Role,
        timeouts: Timeouts = DEFAULT_TIMEOUTS,
        limits: Limits = DEFAULT_LIMITS,
        context: Context | None = None,
    ) -> None:
        super().__init__(addresses, role=role, serves=serves, timeouts=timeouts, limits=limits, context=context)
        self.addresses = tuple(addresses)

    def wait_ready(self) -> tuple[Welcome, ...]:
        """Wait until all workers have started, `timeouts.startup` in all; errors as `Client.wait_ready`."""
        ends = self._startup_ends()
        return tuple(self._wait_ready(address, ends) for address in self.addresses)

    def ping(self) -> tuple[Pong, ...]:
        """How the workers are, in the order of their addresses."""
        return tuple(self._ping(address) for address in self.addresses)
