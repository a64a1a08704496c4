"""Tells of those who knock at a worker's socket and have no key that fits: ZeroMQ turns them away before it asks us.

The socket's monitor says that somebody came, and that the handshake failed, but not who it was. So the address is
looked up when they come; who is gone by then is written down without one.
"""

import os
import socket as network

import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.security.refusals import Refusals

_STRANGER = "it left, or was sent away, before it had shown a key that fits"
"""Which of the two is not told in every case, nor is whether it had none or took us for somebody else."""

_WATCHED = zmq.EVENT_ACCEPTED | zmq.EVENT_HANDSHAKE_SUCCEEDED | zmq.EVENT_HANDSHAKE_FAILED_AUTH | zmq.EVENT_DISCONNECTED


class HandshakeMonitor:
    """What happens at a bound socket, as far as it is about strangers. Belongs to the socket's thread."""

    def __init__(self, socket: "zmq.Socket[bytes]", refusals: Refusals) -> None:
        self._socket = socket
        self._refusals = refusals
        self._knocking: dict[int, str] = {}
        self._is_written_down = False
        self.monitor: zmq.Socket[bytes] = socket.get_monitor_socket(_WATCHED)

    def look(self) -> None:
        """Take in what has happened since the last time."""
        while self.monitor.poll(0):
            message = recv_monitor_message(self.monitor)
            self._take(message["event"], int(message["value"]))

    def close(self) -> None:
        """Watch no more."""
        self._socket.disable_monitor()
        self.monitor.close()

    def _take(self, event: int, value: int) -> None:
        if event == zmq.EVENT_ACCEPTED:
            self._knocking[value] = _peer(value)
        elif event == zmq.EVENT_HANDSHAKE_SUCCEEDED:
            # It does not say whose: the one that knocked last is the likely one, and nothing but a log hangs on it.
            if self._knocking:
                self._knocking.popitem()
        elif event == zmq.EVENT_HANDSHAKE_FAILED_AUTH:
            # By the authenticator, who was asked.
            self._is_written_down = True
        elif event == zmq.EVENT_DISCONNECTED:
            self._leave(value)

    def _leave(self, descriptor: int) -> None:
        address = self._knocking.pop(descriptor, None)
        if address is not None and not self._is_written_down:
            self._refusals.note(address, _STRANGER)
        self._is_written_down = False


def _peer(descriptor: int) -> str:
    """The address at the other end of a connection of this process; empty where it is over."""
    try:
        with network.socket(fileno=os.dup(descriptor)) as connection:
            return str(connection.getpeername()[0])
    except (OSError, IndexError, TypeError):
        return ""
