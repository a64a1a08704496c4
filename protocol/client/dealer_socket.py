"""A ZeroMQ socket that is used for one transport connection only.

A ZeroMQ socket would reconnect by itself, and send to the next worker what the dead one had not read. Here a socket is
closed when its transport connection breaks, with all that it still holds. `Connection` opens the next socket, and the
client decides which calls are sent again.
"""

from enum import Enum, auto

import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.limits import Limits
from protocol.security import Curve
from protocol.timeouts import Timeouts
from protocol.transport.sockets import Context, Socket, connect_dealer, descriptor, has_input

_MONITORED = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED


class SocketEvent(Enum):
    """What ZeroMQ reports of a socket's transport connection."""

    CONNECTED = auto()
    DENIED = auto()
    DISCONNECTED = auto()


_EVENTS: dict[int, SocketEvent] = {
    zmq.EVENT_HANDSHAKE_SUCCEEDED: SocketEvent.CONNECTED,
    zmq.EVENT_HANDSHAKE_FAILED_AUTH: SocketEvent.DENIED,
}


class DealerSocket:
    """A DEALER socket that tries to connect until it succeeds, and the monitor that reports it.

    Attributes:
        socket: for messages to and from the worker.
        monitor: the socket's monitor.
        descriptors: of both, to wait on.

    Raises:
        AddressUnavailable: `address` is not an address.
        Unavailable: the process can open no more files.
    """

    def __init__(
        self, context: Context, address: str, timeouts: Timeouts, limits: Limits, curve: Curve | None = None
    ) -> None:
        self.socket, self.monitor = connect_dealer(context, address, timeouts, limits, _MONITORED, curve)
        self.descriptors = descriptor(self.socket), descriptor(self.monitor)

    @property
    def sockets(self) -> tuple[Socket, Socket]:
        """The sockets that may have input."""
        return self.socket, self.monitor

    def events(self) -> list[SocketEvent]:
        """The events since the last call."""
        events: list[SocketEvent] = []
        while has_input(self.monitor):
            number = int(recv_monitor_message(self.monitor)["event"])
            events.append(_EVENTS.get(number, SocketEvent.DISCONNECTED))
        return events

    def close(self) -> None:
        """Close the socket and drop the messages that it holds. A second call does nothing."""
        if self.socket.closed:
            return
        self.socket.disable_monitor()
        self.monitor.close()
        self.socket.close()
