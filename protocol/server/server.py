"""A worker: a table of handlers behind a socket.

    Starting ──start() returned──▶ Ready ⇄ Busy ──SIGTERM, SIGINT or Drain──▶ Draining ──all answered──▶ gone

`serve` does what the network needs (handshakes, pings, deadlines, limits, refusals, drain); a handler is a function.
"""

import logging
import signal
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import partial
from typing import Any, TypeAlias

from protocol.catalogue import reply_type
from protocol.client.pool import Pool, lacking
from protocol.deadline import deadline
from protocol.errors import InvalidInput, VantageError
from protocol.failpoint import Failpoint, no_failpoint
from protocol.failure import failure_of, internal
from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.message import Reply, Request
from protocol.messages import Failure, Role
from protocol.observer import NO_OBSERVER, Observer, handled, refused
from protocol.security import LOCAL_ONLY, Security
from protocol.security.guard import guard_of
from protocol.server.listener import Job, Listener
from protocol.server.registration_settings import RegistrationSettings
from protocol.server.worker_registration import registered
from protocol.system.priority import let_others_go_first
from protocol.system.signals import ENDING, signals_handled, signals_written_to
from protocol.timeouts import DEFAULT_TIMEOUTS, Timeouts
from protocol.transport.sockets import Context, bind_router, open_context

Handlers: TypeAlias = Mapping[type[Request[Any]], Callable[[Any], Reply]]
"""The function that answers each type of request."""

_log = logging.getLogger(__name__)


class _StartInterrupted(BaseException):
    """A signal came while the worker started, so it has nothing to finish."""


def serve(
    start: Callable[[], Handlers],
    *,
    role: Role,
    bind: str,
    capabilities: Mapping[str, str] | None = None,
    concurrency: int = 1,
    computes: bool = True,
    timeouts: Timeouts = DEFAULT_TIMEOUTS,
    limits: Limits = DEFAULT_LIMITS,
    context: Context | None = None,
    registration: RegistrationSettings | None = None,
    failpoint: Failpoint = no_failpoint,
    security: Security = LOCAL_ONLY,
    observer: Observer = NO_OBSERVER,
    calls: Mapping[Role, Pool] | None = None,
    hand_over: Callable[[Callable[[], None]], None] = lambda drain: None,
) -> None:
    """Serve until SIGTERM, SIGINT, `Drain` or the orchestrator's end, then finish the requests in hand and return.

    The address answers at once, in state STARTING, while `start` loads what the handlers need; requests that arrive
    meanwhile wait. Handlers run in the calling thread and in `concurrency - 1` more. A reply's arrays are not copied:
    a handler must not write to them after it has returned them.

    >>> from threading import Thread
    >>> from protocol import Client, serve
    >>> from protocol.messages import Drain, Lookup, Role, Workers
    >>> def lookup(request: Lookup) -> Workers:
    ...     return Workers(workers=())
    >>> options = {"role": Role.ORCHESTRATOR, "bind": "ipc://registry"}
    >>> worker = Thread(target=serve, args=(lambda: {Lookup: lookup},), kwargs=options)
    >>> worker.start()
    >>> with Client("ipc://registry", role=Role.AGENT) as client:
    ...     client.call(Lookup(role=Role.RENDER))
    ...     client.call(Drain())
    Workers(workers=())
    Drained()
    >>> worker.join()

    Args:
        start: loads what the handlers need, and returns them.
        role: the role of this process.
        bind: the address to serve at.
        capabilities: what the worker says of itself in its `Welcome`.
        concurrency: number of threads that run handlers.
        computes: whether handlers take long. If so, the priority of the calling thread is lowered for good, so that the
            threads that carry messages run first.
        registration: the orchestrator to register with; without it, the worker registers nowhere.
        failpoint: reached at `reply-ROLE`, such as `reply-render`, before a reply is sent.
        security: the keys of this process; without keys it serves only this machine.
        observer: told of the worker, and of each request that is over.
        calls: the pools that handlers call, by role. Their workers are pinged all the time, and a pong names the roles
            of which none is at work.
        hand_over: called with the function that drains the worker, before the worker answers; that function may be
            called from any thread.

    Raises:
        AddressUnavailable: `bind` is in use or can't be served, or the orchestrator's address is not one.
        NotPermitted: `bind` can be reached from other machines, and `security` has no key.
        InvalidInput: `concurrency` is below 1.
        Exception: any error of `start`, after all waiting requests were refused.
    """
    if concurrency < 1:
        raise InvalidInput(f"a worker has one handler thread or more, not {concurrency}")
    credentials = security.credentials_for(bind)
    with open_context(context) as opened, guard_of(opened, role, credentials) as guard:
        listener = Listener(
            bind_router(opened, bind, timeouts, limits, credentials.own if credentials else None),
            guard=guard,
            role=role,
            capabilities=capabilities or {},
            handlers=concurrency,
            timeouts=timeouts,
            limits=limits,
            observer=observer,
            lacks=partial(lacking, calls or {}),
        )
        for pool in (calls or {}).values():
            pool.monitor()
        _log.info("%s listens at %s", role, bind, extra={"incarnation": listener.incarnation})
        hand_over(listener.drain)
        registering = registered(registration, listener, bind, timeouts, security) if registration else nullcontext()
        with _drain_by_signal(listener):
            load = partial(_load_low, start) if computes else start
            _run(listener, load, registering, concurrency, partial(failpoint, f"reply-{role}"))
        _log.info("%s at %s has ended", role, bind)


def _load_low(start: Callable[[], Handlers]) -> Handlers:
    # Before anything is loaded: the threads of libraries inherit the priority of the thread that starts them.
    let_others_go_first()
    return start()


def _run(
    listener: Listener,
    load: Callable[[], Handlers],
    registering: AbstractContextManager[None],
    concurrency: int,
    before_reply: Callable[[], None],
) -> None:
    # First, so that the worker is observed before it answers anything.
    listener.observer.attend(listener)
    listener.start()
    try:
        with registering:
            with _interruption_by_signal():
                handlers = load()
            listener.ready()
            _handle_all(lambda: _handle_jobs(listener, handlers, before_reply), concurrency)
    except _StartInterrupted:
        _log.info("ended by a signal while starting")
    finally:
        listener.stop()


def _handle_all(handle_jobs: Callable[[], None], concurrency: int) -> None:
    others = [
        threading.Thread(target=handle_jobs, name=f"handler-{number}", daemon=True) for number in range(1, concurrency)
    ]
    for thread in others:
        thread.start()
    handle_jobs()
    for thread in others:
        thread.join()


def _handle_jobs(listener: Listener, handlers: Handlers, before_reply: Callable[[], None]) -> None:
    while (job := listener.jobs.get()) is not None:
        begun = listener.clock()
        refusal = _refusal(job, handlers, begun)
        reply = _reply_to(job, handlers[type(job.request)], begun) if refusal is None else refusal
        before_reply()
        queue, compute = begun - job.arrived, listener.clock() - begun
        sent = _answer(listener, job, reply, queue=queue, compute=compute)
        if refusal is None:
            listener.observer.finished(handled(job.request, sent, queue=queue, compute=compute))
        else:
            listener.observer.finished(refused(job.request, refusal, queue=queue))


def _answer(listener: Listener, job: Job, reply: Reply, *, queue: float, compute: float) -> Reply:
    """Send the reply, or why it can't be sent; returns what was sent."""
    try:
        listener.answer(job, reply, queue=queue, compute=compute)
    except VantageError as error:
        _log.exception("the reply to %s can't be sent", type(job.request).__name__)
        reply = internal(f"the reply can't be sent: {error}")
        listener.answer(job, reply, queue=queue, compute=compute)
    return reply


def _refusal(job: Job, handlers: Handlers, now: float) -> Failure | None:
    """Why a request is not handled; None if it is."""
    name = type(job.request).__name__
    if type(job.request) not in handlers:
        return Failure(code="unsupported", message=f"this worker does not answer {name}")
    if now >= job.expires:
        return Failure(code="deadline-exceeded", message=f"{name} waited in the queue until its deadline")
    return None


def _reply_to(job: Job, handler: Callable[[Any], Reply], now: float) -> Reply:
    name = type(job.request).__name__
    try:
        with deadline(job.expires - now):
            reply = handler(job.request)
    except VantageError as error:
        return failure_of(error)
    except Exception as error:
        _log.exception("the handler of %s has failed", name)
        return failure_of(error)
    wanted = reply_type(type(job.request))
    if not isinstance(reply, wanted):
        _log.error("the handler of %s returned a %s, not a %s", name, type(reply).__name__, wanted.__name__)
        return internal(f"the handler of {name} did not return a {wanted.__name__}")
    return reply


@contextmanager
def _interruption_by_signal() -> Generator[None]:
    def interrupt(_number: int) -> None:
        raise _StartInterrupted

    with signals_handled(ENDING, interrupt):
        yield


@contextmanager
def _drain_by_signal(listener: Listener) -> Generator[None]:
    seen: list[int] = []

    def drain(number: int) -> None:
        # A second Ctrl-C does not wait for a handler that hangs.
        if number == signal.SIGINT and number in seen:
            raise KeyboardInterrupt
        seen.append(number)
        listener.drain()

    # A process that was stopped may get its signals in any thread, and a main thread that waits for a job sleeps on.
    # The listener is told in any case, and its end is the end of that wait.
    with signals_handled(ENDING, drain), signals_written_to(listener.wakeup_descriptor):
        yield
