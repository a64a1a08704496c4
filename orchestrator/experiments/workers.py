"""The workers of an experiment, supervised while it waits for their replies."""

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
"""Requests in flight to each worker: one more than it works on, so that it never waits for the next."""

POLL = 0.1
"""Seconds between two polls of the workers; a poll takes a millisecond."""

PERCEIVERS_PER_RENDERER = 2
"""Rendering a picture takes a third of the time of perceiving it."""


class Rate:
    """The progress and speed of some work."""

    def __init__(self, steps: int, done: int = 0, clock: Callable[[], float] = time.monotonic) -> None:
        self._steps = steps
        self._first = self._done = done
        self._clock = clock
        self._began = clock()

    def advance(self) -> None:
        """Count one more step."""
        self._done += 1

    def reach(self, done: int) -> None:
        """Count so many steps in all."""
        self._done = done

    @property
    def count(self) -> FrameCount:
        """The present progress; steps of an earlier process count as done, but not for the speed."""
        seconds = max(self._clock() - self._began, 1e-9)
        speed = (self._done - self._first) / seconds
        return FrameCount(step=self._done, steps=self._steps, steps_per_second=speed)


class WorkerPools:
    """Pools of both roles, whose workers are polled while a caller waits for their replies."""

    def __init__(
        self, renderers: Pool, perceivers: Pool, session: Session, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.renderers = renderers
        self.perceivers = perceivers
        self._session = session
        self._clock = clock
        self._polled = -math.inf

    def check_workers(self, activity: str, rate: Rate | None = None) -> None:
        """Poll the workers and display the progress, unless that was done a moment ago.

        Raises:
            Interrupted: the command was asked to stop.
            ProcessFailed, DeadlineExceeded, VersionMismatch, WrongRole: see `Supervisor.poll`.
        """
        if self._clock() - self._polled < POLL:
            return
        self._polled = self._clock()
        self._session.check_workers(activity, None if rate is None else rate.count)

    def wait_for(self, pending: Pending[ReplyT], activity: str, rate: Rate | None = None) -> ReplyT:
        """Wait for a reply; errors as `check_workers`, and those of the call itself."""
        self.check_workers(activity, rate)
        while not wait([pending], timeout=POLL).done:
            self.check_workers(activity, rate)
        return pending.result()

    def answers(
        self, pool: Pool, requests: Iterable[Request[ReplyT]], activity: str, rate: Rate | None = None
    ) -> Iterator[ReplyT]:
        """The replies, in the order of the requests; errors as `wait_for`."""
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
        """The capabilities of the perception workers.

        Raises:
            InvalidInput: they differ, so the table would mix two experiments.
        """
        first, *others = (welcome.capabilities for welcome in self.perceivers.wait_ready())
        for other in others:
            if differing := {name for name in first | other if first.get(name) != other.get(name)}:
                raise InvalidInput(
                    f"the perception workers differ in {', '.join(sorted(differing))}; all must be alike"
                )
        return first


def with_workers(config: RunConfig, perceivers: int) -> RunConfig:
    """The configuration with this number of perception workers, and the render workers that keep them busy."""
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
    """The workers that the configuration asks for, ready; all have ended afterwards.

    Args:
        join: a host whose workers are used instead. It is told when the work inside succeeds.

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
        # Without processes: the remote workers are supervised on their own machines.
        Fleet(log_directory(), stop) as fleet,
        Supervisor(fleet, config.supervision, timeouts) as supervisor,
        _pool(Role.RENDER, timeouts, security=join.security) as renderers,
        _pool(Role.PERCEPTION, timeouts, security=join.security) as perceivers,
    ):
        session = Session(fleet, supervisor, display, stop, remote_workers=host)
        session.wait_for_remote_workers(timeouts.startup)
        for pool, role in ((renderers, Role.RENDER), (perceivers, Role.PERCEPTION)):
            host.follow(pool, role)
            pool.wait_any_ready()
        yield WorkerPools(renderers, perceivers, session)


def _pool(serves: Role, timeouts: Timeouts, addresses: tuple[str, ...] = (), security: Security = LOCAL_ONLY) -> Pool:
    # A host's workers accept requests for views with the key of an agent.
    return Pool(addresses, role=Role.AGENT, serves=serves, timeouts=timeouts, security=security)
