"""The sockets' own promises; what they carry is tested with the client and the server."""

import math
import threading

import pytest
import zmq
from zmq.utils.monitor import recv_monitor_message

from protocol.limits import DEFAULT_LIMITS, Limits
from protocol.timeouts import DEFAULT_TIMEOUTS
from protocol.transport.sockets import connect_dealer, descriptor, has_input, poll_timeout, received, wait_for_input


def test_the_monitor_is_there_before_the_connection_is_made():
    with zmq.Context() as context:
        listening = context.socket(zmq.ROUTER)
        port = listening.bind_to_random_port("tcp://127.0.0.1")
        dealer, monitor = connect_dealer(
            context, f"tcp://127.0.0.1:{port}", DEFAULT_TIMEOUTS, DEFAULT_LIMITS, zmq.EVENT_CONNECT_DELAYED
        )
        # This event is told while the socket connects: a monitor that came later would wait for ever.
        assert monitor.poll(2000)
        assert recv_monitor_message(monitor)["event"] == zmq.EVENT_CONNECT_DELAYED
        dealer.disable_monitor()
        for socket in (monitor, dealer, listening):
            socket.close()


def test_a_message_of_endless_parts_is_not_kept():
    with zmq.Context() as context, context.socket(zmq.PAIR) as sender, context.socket(zmq.PAIR) as receiver:
        receiver.bind("inproc://parts")
        sender.connect("inproc://parts")
        sender.send_multipart([b"x"] * 1000)
        sender.send_multipart([b"next"])
        endless, after = received(receiver, Limits(arrays=4))
    assert 3 + 4 < len(endless) < 20
    assert after == [b"next"]


def test_a_thread_can_wait_for_a_socket_that_others_use():
    with zmq.Context() as context, context.socket(zmq.PAIR) as sender, context.socket(zmq.PAIR) as receiver:
        receiver.bind("inproc://waited-for")
        sender.connect("inproc://waited-for")
        # Asked first, as its descriptor tells only of what has changed since.
        assert not has_input(receiver)
        waiting = threading.Thread(target=wait_for_input, args=([descriptor(receiver)], 20_000))
        waiting.start()
        receiver.send(b"used meanwhile")
        assert waiting.is_alive()
        sender.send(b"input")
        waiting.join(10)
        assert not waiting.is_alive()
        assert has_input(receiver)


@pytest.mark.parametrize(
    ("seconds", "milliseconds"), [(-1.0, 0), (0.0, 0), (0.0001, 1), (0.0021, 3), (1.0, 1000), (math.inf, 60_000)]
)
def test_a_poll_never_ends_before_what_it_waits_for_nor_lasts_for_ever(seconds, milliseconds):
    assert poll_timeout(seconds) == milliseconds
