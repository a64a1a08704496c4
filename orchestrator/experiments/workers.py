"""The workers of an experiment: as many as are asked for, looked after while their answers are waited for."""

import math
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import wait
from contextlib import contextmanager

from msgspec.structs import replace

from orchestrator.hosting.joining import Join, JoinedHost, dismiss
from orchestrator.local_workers import local_workers
from orchestrator.monitoring.live_display import Display, FrameCount, Snapshot
from orchestrator.run.run_log import log_directory
from orchestrator.session import Session
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import addresses
from orchestrator.supervision.supervisor import Supervisor
from protocol.client.pending import Pending
from protocol.client.pool import Pool
from protocol.config import RunConfig
from protocol.errors import InvalidInput
from protocol.message import ReplyT, Request
from protocol.messages import Role
from protocol.security import LOCAL_ONLY, Security
from protocol.system.stop_request import StopRequest
from protocol.timeouts import Timeouts

AHEAD = 3
"""Requests under way to each worker; one more than it works on, so that it never waits for us."""

LOOK = 0.1
"""Seconds between two looks at the workers; one costs a millisecond."""

PERCEIVERS_PER_RENDERER = 2
"""A picture is drawn in a third of the time that it takes to make sense of it."""


class Rate:
    """How far a stretch of work is, and how fast it goes."""

    def __init__(self, steps: int, done: int = 0, clock: Callable[[], float] = time.monotonic) -> None:
        self._steps = steps
        self._first = self._done = done
        self._clock = clock
        self._began = clock()

    def advance(self) -> None:
        """One more is done."""
        self._done += 1

    @property
    def count(self) -> FrameCount:
        """As of now; what an earlier process did counts as done, and not for the speed."""
        seconds = max(self._clock() - self._began, 1e-9)
        speed = (self._done - self._first) / seconds
        return FrameCount(step=self._done, steps=self._steps, steps_per_second=speed)


class WorkerPools:
    """Pools of both roles; those who wait for their answers look after them."""

    def __init__(
        self, renderers: Pool, perceivers: Pool, session: Session, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.renderers = renderers
        self.perceivers = perceivers
        self._session = session
        self._clock = clock
        self._looked = -math.inf

    def attend(self, activity: str, rate: Rate | None = None) -> None:
        """Look after the workers and show how far we are, unless that was done a moment ago.

        Raises:
            Interrupted: somebody asked to stop.
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.look`.
        """
        if self._clock() - self._looked < LOOK:
            return
        self._looked = self._clock()
        self._session.attend(activity, None if rate is None else rate.count)

    def wait_for(self, pending: Pending[ReplyT], activity: str, rate: Rate | None = None) -> ReplyT:
        """The answer; errors as `attend`, and those of the call itself."""
        self.attend(activity, rate)
        while not wait([pending], timeout=LOOK).done:
            self.attend(activity, rate)
        return pending.result()

    def answers(
        self, pool: Pool, requests: Iterable[Request[ReplyT]], activity: str, rate: Rate | None = None
    ) -> Iterator[ReplyT]:
        """In the order of the requests; errors as `wait_for`."""
        under_way: deque[Pending[ReplyT]] = deque()
        try:
            for request in requests:
                under_way.append(pool.submit(request))
                if len(under_way) >= AHEAD * max(1, len(pool.addresses)):
                    yield self.wait_for(under_way.popleft(), activity, rate)
            while under_way:
                yield self.wait_for(under_way.popleft(), activity, rate)
        finally:
            for pending in under_way:
                pending.cancel()

    def capabilities(self) -> dict[str, str]:
        """What the perception workers say of themselves.

        Raises:
            InvalidInput: they don't say the same, so that the table would be of two experiments.
        """
        first, *others = (welcome.capabilities for welcome in self.perceivers.wait_ready())
        for other in others:
            if differing := {name for name in first | other if first.get(name) != other.get(name)}:
                raise InvalidInput(
                    f"the perception workers differ in {', '.join(sorted(differing))}; all must be alike"
                )
        return first


def with_workers(config: RunConfig, perceivers: int) -> RunConfig:
    """The configuration with that many perception workers, and the render workers that keep them busy."""
    renderers = -(-perceivers // PERCEIVERS_PER_RENDERER)
    return replace(
        config,
        render=replace(config.render, workers=renderers),
        perception=replace(config.perception, workers=perceivers),
    )


@contextmanager
def experiment_workers(
    config: RunConfig, join: Join | None = None, *, display: Display, stop: StopRequest
) -> Generator[WorkerPools]:
    """The workers that the configuration asks for, ready; none is left when this ends.

    Args:
        join: a host whose workers are to be worked with instead. It is told when this ends well.

    Raises:
        ProcessFailed, DeadlineExceeded, Interrupted, HostLost, HostNotTold: as for a training.
    """
    timeouts = Timeouts.from_config(config.timeouts)
    if join is None:
        with _started(config, timeouts, display, stop) as workers:
            yield workers
    else:
        with _joined(join, config, timeouts, display, stop) as workers:
            yield workers
        dismiss(join, timeouts, lambda words: display.show(Snapshot(activity=words, elapsed=0.0)), stop)


@contextmanager
def _started(config: RunConfig, timeouts: Timeouts, display: Display, stop: StopRequest) -> Generator[WorkerPools]:
    with (
        local_workers(config, timeouts, display=display, stop=stop) as (launches, session),
        _pool(Role.RENDER, timeouts, addresses(launches, Role.RENDER)) as renderers,
        _pool(Role.PERCEPTION, timeouts, addresses(launches, Role.PERCEPTION)) as perceivers,
    ):
        yield WorkerPools(renderers, perceivers, session)


@contextmanager
def _joined(
    join: Join, config: RunConfig, timeouts: Timeouts, display: Display, stop: StopRequest
) -> Generator[WorkerPools]:
    with (
        JoinedHost(join, "experiment", timeouts) as host,
        # Of nobody: what is elsewhere, others look after.
        Fleet(log_directory(), stop) as fleet,
        Supervisor(fleet, config.supervision, timeouts) as supervisor,
        _pool(Role.RENDER, timeouts, security=join.security) as renderers,
        _pool(Role.PERCEPTION, timeouts, security=join.security) as perceivers,
    ):
        session = Session(fleet, supervisor, display, stop, remote_workers=host)
        session.wait_for_others(timeouts.startup)
        for pool, role in ((renderers, Role.RENDER), (perceivers, Role.PERCEPTION)):
            host.follow(pool, role)
            pool.wait_any_ready()
        yield WorkerPools(renderers, perceivers, session)


def _pool(serves: Role, timeouts: Timeouts, addresses: tuple[str, ...] = (), security: Security = LOCAL_ONLY) -> Pool:
    # A host's workers take requests for views from whoever has an agent's key.
    return Pool(addresses, role=Role.AGENT, serves=serves, timeouts=timeouts, security=security)
