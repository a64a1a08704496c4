import random
import socket

import pytest

from orchestrator.chaos.scenarios.intruder import (
    GREETING,
    READY,
    garbage_messages,
    garbage_talks,
    oversized_messages,
    oversized_talks,
    send_messages,
    talk,
)
from orchestrator.chaos.scenarios.pings import answers, ping
from orchestrator.supervision.heartbeat import is_alive
from protocol.messages import Role


@pytest.fixture
def worker(rehearsed, start_worker, address):
    worker = start_worker(address=address)
    rehearsed.wait(lambda: answers(worker), "it answered")
    return worker


def pong_of(worker):
    pong = ping(worker)
    assert pong is not None
    return pong


@pytest.fixture(params=["ipc", "tcp"])
def address(request, unused_port):
    return None if request.param == "ipc" else f"tcp://127.0.0.1:{unused_port}"


@pytest.fixture
def unused_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.mark.slow
def test_garbage_comes_through_to_the_worker_and_ends_nobody(rehearsed, worker):
    before = pong_of(worker)
    send_messages(worker.address, garbage_messages(random.Random(1)))
    talk(worker.address, garbage_talks(random.Random(1)))
    rehearsed.wait(lambda: pong_of(worker).malformed >= before.malformed + 10, "garbage was counted")
    assert pong_of(worker).incarnation == before.incarnation
    assert is_alive(worker)


@pytest.mark.slow
def test_bare_bytes_get_as_far_as_to_be_taken_for_a_message(rehearsed, worker):
    before = pong_of(worker)
    talk(worker.address, iter([(GREETING, READY, b"\x00\x01?")]))
    rehearsed.wait(lambda: pong_of(worker).malformed == before.malformed + 1, "it was counted")


@pytest.mark.slow
def test_oversized_messages_come_through_to_the_worker_and_end_nobody(rehearsed, worker):
    before = pong_of(worker)
    send_messages(worker.address, oversized_messages())
    talk(worker.address, oversized_talks())
    rehearsed.wait(lambda: pong_of(worker).malformed >= before.malformed + 3, "they were counted")
    after = pong_of(worker)
    assert after.incarnation == before.incarnation
    assert after.resident_bytes < before.resident_bytes + 64 * 2**20


def test_who_serves_nothing_answers_no_ping(start):
    assert not answers(start("agent", Role.AGENT))
