"""One connection of a client to an address, from before it is made until it breaks.

A ZeroMQ socket would connect again by itself and send whatever the dead worker did not take to the next one. Here a
socket lives for one connection: what was under way is dropped with it, and the client alone says what is sent again.
"""

from enum import Enum, auto

import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.limits import Limits
from protocol.security import Curve
from protocol.timeouts import Timeouts
from protocol.transport.sockets import Context, Socket, connect_dealer, descriptor, has_input

_WATCHED = zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED


class LineEvent(Enum):
    """What happens to a line."""

    MADE = auto()
    DENIED = auto()
    BROKEN = auto()


_EVENTS: dict[int, LineEvent] = {
    zmq.EVENT_HANDSHAKE_SUCCEEDED: LineEvent.MADE,
    zmq.EVENT_HANDSHAKE_FAILED_AUTH: LineEvent.DENIED,
}


class DealerSocket:
    """A socket that tries to connect until it has, and the monitor that tells so.

    Attributes:
        descriptors: of both, to wait on.

    Raises:
        AddressUnavailable: there can be nothing at the address.
    """

    def __init__(
        self, context: Context, address: str, timeouts: Timeouts, limits: Limits, curve: Curve | None = None
    ) -> None:
        self.socket, self.monitor = connect_dealer(context, address, timeouts, limits, _WATCHED, curve)
        self.descriptors = descriptor(self.socket), descriptor(self.monitor)

    @property
    def sockets(self) -> tuple[Socket, Socket]:
        """Where something may come."""
        return self.socket, self.monitor

    def events(self) -> list[LineEvent]:
        """What has happened since the last time."""
        events: list[LineEvent] = []
        while has_input(self.monitor):
            events.append(_EVENTS.get(int(recv_monitor_message(self.monitor)["event"]), LineEvent.BROKEN))
        return events

    def close(self) -> None:
        """Drop the connection and all that is under way on it; once closed, nothing."""
        if self.socket.closed:
            return
        self.socket.disable_monitor()
        self.monitor.close()
        self.socket.close()
