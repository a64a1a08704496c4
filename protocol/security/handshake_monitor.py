"""Logs the clients whose handshake with a worker fails in ZeroMQ itself, before the authenticator is asked.

The socket's monitor reports that a client connected, and that its handshake failed, but not the client's address. So
the address is looked up when the client connects. A client that has gone by then is logged without it.
"""

import os
import socket as network

import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.security.refusals import Refusals

_NO_VALID_KEY = "it left, or was disconnected, before it had shown a valid key"
"""ZeroMQ does not always report which of the two, nor whether it had no key or expected another one of the worker."""

_EVENTS = zmq.EVENT_ACCEPTED | zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED


class HandshakeMonitor:
    """Monitors the handshakes on a bound socket. Belongs to the socket's thread.

    Attributes:
        monitor: the monitor's socket, to wait on for `read_events`.
    """

    def __init__(self, socket: "zmq.Socket[bytes]", refusals: Refusals) -> None:
        self._socket = socket
        self._refusals = refusals
        self._connecting: dict[int, str] = {}
        self._is_logged = False
        self.monitor: zmq.Socket[bytes] = socket.get_monitor_socket(_EVENTS)

    def read_events(self) -> None:
        """Read the events since the last call, and log the handshakes that failed."""
        while self.monitor.poll(0):
            message = recv_monitor_message(self.monitor)
            self._take(message["event"], int(message["value"]))

    def close(self) -> None:
        """Stop monitoring."""
        self._socket.disable_monitor()
        self.monitor.close()

    def _take(self, event: int, value: int) -> None:
        if event == zmq.EVENT_ACCEPTED:
            self._connecting[value] = _peer(value)
        elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            # The event does not say which client's: probably the last one's, and only the log depends on it.
            if self._connecting:
                self._connecting.popitem()
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            # The authenticator refused and logged it.
            self._is_logged = True
        elif event == zmq.EVENT_DISCONNECTED:
            self._disconnected(value)

    def _disconnected(self, descriptor: int) -> None:
        address = self._connecting.pop(descriptor, None)
        if address is not None and not self._is_logged:
            self._refusals.note(address, _NO_VALID_KEY)
        self._is_logged = False


def _peer(descriptor: int) -> str:
    """The IP address of the peer of one of this process's connections; empty if it is closed."""
    try:
        with network.socket(fileno=os.dup(descriptor)) as connection:
            return str(connection.getpeername()[0])
    except (OSError, IndexError, TypeError):
        return ""
