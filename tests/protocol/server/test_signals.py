"""How a worker's process ends, and what it leaves behind."""

import signal
from pathlib import Path

import psutil
import pytest

from protocol.messages import State
from tests.protocol.processes.calls import ask, client_of

pytestmark = pytest.mark.slow

ENDS = [signal.SIGTERM, signal.SIGINT]


@pytest.mark.parametrize("number", ENDS)
def test_a_signal_lets_the_worker_finish_what_is_in_hand(address, start, number):
    worker = start("serves_scenes")
    with client_of(address) as client:
        client.wait_ready()
        pending = [client.submit(ask(-200)), client.submit(ask(-100))]
        while client.ping().queue_depth < 2:
            pass
        worker.send_signal(number)
        assert [one.result().scene.yaw for one in pending] == [-200, -100]
        assert client.statistics.losses == 0
    assert worker.wait(10) == 0
    assert not Path(address.removeprefix("ipc://")).exists()


@pytest.mark.parametrize("number", ENDS)
def test_a_signal_ends_a_worker_that_still_starts(address, start, number):
    worker = start("takes_long_to_start")
    with client_of(address) as client:
        assert client.ping().state is State.STARTING
        worker.send_signal(number)
        assert worker.wait(10) == 0


@pytest.mark.parametrize("number", ENDS)
@pytest.mark.parametrize("again", range(3))
def test_a_signal_that_came_while_the_worker_was_stopped_ends_it(address, start, number, again):
    """The system gives it to any thread; the main one slept on in four of five cases."""
    worker = start("serves_scenes")
    with client_of(address) as client:
        client.wait_ready()
        worker.send_signal(signal.SIGSTOP)
        while psutil.Process(worker.pid).status() != psutil.STATUS_STOPPED:
            pass
        worker.send_signal(number)
        worker.send_signal(signal.SIGCONT)
        assert worker.wait(10) == 0


def test_a_second_ctrl_c_does_not_wait_for_a_handler(address, start):
    worker = start("serves_scenes")
    with client_of(address) as client:
        client.wait_ready()
        client.submit(ask(-600_000))
        while client.ping().queue_depth < 1:
            pass
        worker.send_signal(signal.SIGINT)
        while client.ping().state is not State.DRAINING:
            pass
        worker.send_signal(signal.SIGINT)
        assert worker.wait(10) != 0


def test_the_socket_that_a_killed_worker_left_is_replaced(address, start):
    worker = start("serves_scenes")
    with client_of(address) as client:
        client.wait_ready()
        worker.kill()
        worker.wait()
        assert Path(address.removeprefix("ipc://")).is_socket()
        start("serves_scenes")
        assert client.call(ask(1)).scene.yaw == 1


def test_a_worker_whose_address_is_taken_ends_and_leaves_the_other_alone(address, start):
    first = start("serves_scenes")
    with client_of(address) as client:
        incarnation = client.wait_ready().incarnation
        assert start("serves_scenes").wait(10) != 0
        assert client.ping().incarnation == incarnation
    assert first.poll() is None
