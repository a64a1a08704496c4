"""The sockets of clients and workers, and the whole messages that they send and receive.

A socket refuses a part that is larger than its limits allow before it allocates memory for it.
"""

import math
import select
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple, TypeAlias

import zmq

from protocol.array_part import Part
from protocol.errors import AddressUnavailable
from protocol.limits import KIB, Limits
from protocol.security import Curve, KeyPair
from protocol.system.descriptors import require_descriptors
from protocol.system.priority import going_first
from protocol.timeouts import Timeouts
from protocol.transport.address import check_address, clear_stale_socket, ipc_path

Context: TypeAlias = zmq.Context[zmq.Socket[bytes]]
Socket: TypeAlias = zmq.Socket[bytes]

BORROWED_FROM = 64 * KIB
"""Parts of at least this many bytes are sent and received without a copy; for smaller ones a copy is cheaper."""

# Plain numbers, since to combine two of zmq's flags takes longer than to send a small part.
_EVENTS = int(zmq.EVENTS)
_INPUT = int(zmq.POLLIN)
_AT_ONCE = int(zmq.DONTWAIT)
_AT_ONCE_WITH_MORE = int(zmq.DONTWAIT) | int(zmq.SNDMORE)

_REPLIES_WAITING = 1024
"""Replies kept for a client that does not read them; later ones are dropped."""

_LAST_WORDS_MS = 1000
_LONGEST_POLL = 60.0
_RECONNECT_MS = 50
_LONGEST_RECONNECT_MS = 500


@contextmanager
def open_context(given: Context | None) -> Generator[Context]:
    """Yield the given context, or a new one that is terminated on exit."""
    if given is not None:
        yield given
        return
    own = new_context()
    try:
        yield own
    finally:
        own.term()


def new_context() -> Context:
    """A context whose I/O threads have priority.

    Raises:
        Unavailable: the process can open no more files.
    """
    require_descriptors()
    context: Context = zmq.Context()
    # The threads start with the context's first socket, and inherit the scheduling of the thread that opens it.
    with going_first():
        context.socket(zmq.PAIR).close()
    return context


def connect_dealer(
    context: Context, address: str, timeouts: Timeouts, limits: Limits, events: int, curve: Curve | None = None
) -> tuple[Socket, Socket]:
    """A client's socket, which tries to connect as long as it is open, and a monitor of its events.

    Args:
        events: those that the monitor reports, as a sum of ZeroMQ's flags.
        curve: the keys to encrypt with; None without encryption.

    Raises:
        AddressUnavailable: `address` is not an address.
        Unavailable: the process can open no more files.
    """
    check_address(address)
    require_descriptors()
    dealer = _open(context, zmq.DEALER, address, timeouts, limits)
    # With IMMEDIATE, ZeroMQ would drop the last replies of a worker that ends.
    dealer.set(zmq.IMMEDIATE, 0)
    dealer.set(zmq.SNDHWM, 0)
    dealer.set(zmq.RECONNECT_IVL, _RECONNECT_MS)
    if curve is not None:
        dealer.set_string(zmq.CURVE_SERVERKEY, curve.server)
        _set_key(dealer, curve.own)
    dealer.set(zmq.RECONNECT_IVL_MAX, _LONGEST_RECONNECT_MS)
    # Before connecting: the monitor does not report a connection that is older than itself.
    monitor = dealer.get_monitor_socket(events)
    try:
        dealer.connect(address)
    except zmq.ZMQError as error:
        dealer.disable_monitor()
        monitor.close()
        dealer.close()
        raise AddressUnavailable(f"can't connect to {address}: {error.strerror}") from error
    return dealer, monitor


def bind_router(
    context: Context, address: str, timeouts: Timeouts, limits: Limits, key: KeyPair | None = None
) -> Socket:
    """A worker's socket, encrypted with `key` if there is one.

    Raises:
        AddressUnavailable: the address is in use, can't be bound on this machine, or is not an address.
        Unavailable: the process can open no more files.
    """
    check_address(address)
    require_descriptors()
    clear_stale_socket(address)
    router = _open(context, zmq.ROUTER, address, timeouts, limits)
    router.set(zmq.ROUTER_MANDATORY, 1)
    router.set(zmq.SNDHWM, _REPLIES_WAITING)
    router.set(zmq.RCVHWM, limits.queue)
    if key is not None:
        router.set(zmq.CURVE_SERVER, 1)
        _set_key(router, key)
    try:
        router.bind(address)
    except zmq.ZMQError as error:
        router.close()
        if error.errno == zmq.EADDRINUSE:
            raise AddressUnavailable(
                f"{address} is in use; stop the process that serves there, or choose another address"
            ) from error
        raise AddressUnavailable(f"{address} can't be served: {error.strerror}") from error
    return router


def close_router(router: Socket) -> None:
    """Close a worker's socket and remove its file; ZeroMQ still tries to send the last replies for a second."""
    # The file first: once the socket is closed, another worker may bind there and make its own file.
    path = ipc_path(router.get_string(zmq.LAST_ENDPOINT))
    if path is not None:
        path.unlink(missing_ok=True)
    router.close(linger=_LAST_WORDS_MS)


def send(socket: Socket, parts: Sequence[Part]) -> bool:
    """Send a message; False if the socket does not take it (it has no connection, or its queue is full)."""
    *first, last = parts
    try:
        for part in first:
            socket.send(part, _AT_ONCE_WITH_MORE, copy=len(part) < BORROWED_FROM)
        socket.send(last, _AT_ONCE, copy=len(last) < BORROWED_FROM)
    except zmq.ZMQError as error:
        if error.errno in (zmq.EAGAIN, zmq.EHOSTUNREACH):
            return False
        raise
    return True


class Arrival(NamedTuple):
    """A whole message; with keys, also the public key that its sender has proved, and the sender's IP address."""

    parts: list[Part]
    key: str = ""
    address: str = ""


def arrivals(socket: Socket, limits: Limits, *, keyed: bool = False, most: int = 64) -> Iterator[Arrival]:
    """The whole messages that wait in the socket, at most `most`; of the parts past the limit only one is kept.

    Args:
        keyed: whether senders have proved keys.
    """
    kept = limits.parts + 2
    for _ in range(most):
        # Asked first, since an empty socket's error takes longer.
        if not has_input(socket):
            return
        part = socket.recv(_AT_ONCE, copy=False)
        parts = [_taken(part)]
        while part.more:
            part = socket.recv(copy=False)
            if len(parts) < kept:
                parts.append(_taken(part))
        yield Arrival(parts, str(part.get("User-Id")), str(part.get("Peer-Address"))) if keyed else Arrival(parts)


def received(socket: Socket, limits: Limits) -> Iterator[list[Part]]:
    """The parts of the whole messages that wait in a client's socket; see `arrivals`."""
    for parts, _, _ in arrivals(socket, limits):
        yield parts


def has_input(socket: Socket) -> bool:
    """Whether a message waits in the socket."""
    return bool(int(socket.get(_EVENTS)) & _INPUT)


def descriptor(socket: Socket) -> int:
    """The file descriptor to wait on for input."""
    return int(socket.get(zmq.FD))


def wait_for_input(descriptors: Iterable[int], timeout_ms: int | None) -> list[int]:
    """Wait for input, and return the readable descriptors; other threads may use the sockets meanwhile.

    `zmq.poll` uses a socket while it waits. A socket's descriptor can be polled by one thread while another sends, but
    it reports each change only once, to the next thread that uses the socket. So call `has_input` before waiting, and
    after using a socket wake the thread that waits for it.
    """
    poller = select.poll()
    for number in descriptors:
        poller.register(number, select.POLLIN)
    return [number for number, _ in poller.poll(timeout_ms)]


def poll_timeout(seconds: float) -> int:
    """Milliseconds to wait, rounded up so that a poll never ends before the time; a minute at most."""
    return math.ceil(min(max(0.0, seconds), _LONGEST_POLL) * 1000)


def _set_key(socket: Socket, key: KeyPair) -> None:
    socket.set_string(zmq.CURVE_PUBLICKEY, key.public)
    socket.set_string(zmq.CURVE_SECRETKEY, key.secret)


def _open(context: Context, kind: int, address: str, timeouts: Timeouts, limits: Limits) -> Socket:
    socket = context.socket(kind)
    socket.set(zmq.LINGER, 0)
    socket.set(zmq.MAXMSGSIZE, limits.part_bytes)
    # With IPv6 on, a host name means its IPv6 address only, and a worker on the IPv4 address is not found.
    socket.set(zmq.IPV6, int("[" in address))
    silence = math.ceil(timeouts.silence * 1000)
    socket.set(zmq.HEARTBEAT_IVL, max(1, silence // 4))
    socket.set(zmq.HEARTBEAT_TIMEOUT, silence)
    socket.set(zmq.HANDSHAKE_IVL, silence)
    socket.copy_threshold = BORROWED_FROM
    return socket


def _taken(part: zmq.Frame) -> Part:
    """The part's bytes; a small part is copied, so that it does not keep a whole receive buffer alive."""
    return part.buffer if len(part) >= BORROWED_FROM else part.bytes
