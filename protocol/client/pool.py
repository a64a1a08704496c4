"""A client of several workers that serve the same role."""

from collections.abc import Mapping, Sequence
from typing import Any

from protocol.client.caller import Caller
from protocol.client.diagnosis import Standing
from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.messages import Ping, Pong, Role, Welcome
from protocol.security import LOCAL_ONLY, Security
from protocol.system.process_lock import ProcessLock
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts
from protocol.transport.address import check_address
from protocol.transport.sockets import Context


class Pool(Caller):
    """Spreads calls over workers: each goes to the ready one with the fewest in hand.

    What a lost worker held goes to another at once. Workers may come and go while calls are under way; while there is
    none, calls wait. Arguments and errors are `Client`'s.
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
        security: Security = LOCAL_ONLY,
    ) -> None:
        super().__init__(
            addresses, role=role, serves=serves, timeouts=timeouts, limits=limits, context=context, security=security
        )
        self._changing = ProcessLock()

    def _arguments(self) -> dict[str, Any]:
        return {"addresses": self._addresses, **super()._arguments()}

    @property
    def addresses(self) -> tuple[str, ...]:
        """Of the workers that calls go to now."""
        return self._addresses

    def add(self, address: str, key: str = "") -> None:
        """Have one more worker, which has to prove `key`; one that is there already stays as it is.

        Raises:
            AddressUnavailable: `address` is none.
            NotPermitted: it can't be spoken to with the keys that there are, or `key` is none of the role.
        """
        check_address(address)
        self._security.curve_to(address, self._serves, key)
        dispatcher = self._dispatcher
        with self._changing:
            if address not in self._addresses:
                self._announced[address] = key
                self._addresses = (*self._addresses, address)
                dispatcher.add(lambda: self._connect(address, key))

    def remove(self, address: str) -> None:
        """Let a worker go. What it has in hand goes to another at once, and what it still answers is dropped."""
        dispatcher = self._dispatcher
        with self._changing:
            if address in self._addresses:
                self._addresses = tuple(one for one in self._addresses if one != address)
                dispatcher.remove(address)

    def wait_ready(self) -> tuple[Welcome, ...]:
        """Wait until all workers have started, `timeouts.startup` in all; errors as `Client.wait_ready`."""
        ends = self._startup_ends()
        return tuple(self._wait_ready(address, ends) for address in self.addresses)

    def wait_any_ready(self) -> None:
        """Wait until one worker at least has started, also one that is not known yet; errors as `wait_ready`."""
        self._submit(Ping(), self._timeouts.startup, None, at_once=False).result()

    def watch(self) -> None:
        """Ping the workers also while they hold no calls, so that `standings` are never old."""
        self._dispatcher.watch()

    def standings(self) -> tuple[Standing, ...]:
        """How each worker stands, as of what was heard of it last; asks nobody."""
        return self._dispatcher.standings()

    @property
    def turns(self) -> int:
        """How many turns the thread that waits on the sockets has taken."""
        return self._dispatcher.turns

    def wake(self) -> None:
        """Have that thread take a turn."""
        self._dispatcher.wake()

    def ping(self) -> tuple[Pong, ...]:
        """How the workers are, in the order of their addresses."""
        return tuple(self._ping(address) for address in self.addresses)


def lacking(pools: Mapping[Role, Pool]) -> tuple[Role, ...]:
    """The roles of which no worker is at work."""
    return tuple(role for role, pool in pools.items() if not any(one.at_work for one in pool.standings()))
