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
    """Spreads calls over workers: each call goes to the ready worker that holds the fewest.

    Calls that a lost worker held are sent to another at once. Workers can be added and removed while calls are under
    way; without a worker, calls wait. Arguments and errors are those of `Client`.

    >>> from protocol import Pool
    >>> from protocol.messages import Role, SampleScene
    >>> with Pool(["ipc://render-0", "ipc://render-1"], role=Role.AGENT, serves=Role.RENDER) as renderers:
    ...     one = renderers.call(SampleScene(seed=7, split="train")).scene
    ...     replies = renderers.map(SampleScene(seed=seed, split="train") for seed in range(5, 10))
    ...     scenes = [reply.scene for reply in replies]  # in the order of the requests
    >>> len(scenes), scenes[2] == one
    (5, True)
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
        """The addresses of the pool's workers."""
        return self._addresses

    def add(self, address: str, key: str = "") -> None:
        """Add a worker, which has to prove `key`; nothing changes if the pool has its address already.

        Raises:
            AddressUnavailable: `address` is not an address.
            NotPermitted: the pool has no key that the worker may be called with, or `key` is not one of the role.
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
        """Remove a worker. The calls that it holds are sent to another at once; its replies to them are dropped."""
        dispatcher = self._dispatcher
        with self._changing:
            if address in self._addresses:
                self._addresses = tuple(one for one in self._addresses if one != address)
                dispatcher.remove(address)

    def wait_ready(self) -> tuple[Welcome, ...]:
        """Wait until all workers have started, for `timeouts.startup` in all; errors as in `Client.wait_ready`."""
        ends = self._startup_ends()
        return tuple(self._wait_ready(address, ends) for address in self.addresses)

    def wait_any_ready(self) -> None:
        """Wait until at least one worker has started, which may be added meanwhile; errors as in `wait_ready`."""
        self._submit(Ping(), self._timeouts.startup, None, at_once=False).result()

    def monitor(self) -> None:
        """Ping the workers also while they hold no calls, so that `standings` stays current."""
        self._dispatcher.monitor()

    def standings(self) -> tuple[Standing, ...]:
        """How each worker stands, by its last messages; sends nothing."""
        return self._dispatcher.standings()

    @property
    def turns(self) -> int:
        """The number of turns that the I/O thread has taken."""
        return self._dispatcher.turns

    def wake(self) -> None:
        """Make the I/O thread take a turn."""
        self._dispatcher.wake()

    def ping(self) -> tuple[Pong, ...]:
        """The workers' states, in the order of their addresses."""
        return tuple(self._ping(address) for address in self.addresses)


def lacking(pools: Mapping[Role, Pool]) -> tuple[Role, ...]:
    """The roles of the pools that have no worker at work."""
    return tuple(role for role, pool in pools.items() if not any(one.at_work for one in pool.standings()))
