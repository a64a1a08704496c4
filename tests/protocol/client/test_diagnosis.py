"""A client knows why a worker is not at work, without asking it for anything."""

import signal

import pytest
from msgspec.structs import replace

from protocol import Pool
from protocol.messages import Role
from tests.protocol.processes.calls import PATIENT
from tests.protocol.processes.waiting import wait_until


@pytest.fixture
def pool(address):
    """Of one worker."""
    timeouts = replace(PATIENT, liveness=0.3)
    with Pool([address], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=timeouts) as pool:
        pool.monitor()
        yield pool


def reason(pool: Pool) -> str:
    (standing,) = pool.standings()
    assert standing.at_work == (not standing.reason)
    return standing.reason


def test_one_that_is_there_is_at_work(pool, address, start):
    start("serves_scenes")
    wait_until(lambda: pool.standings()[0].at_work)
    assert pool.standings()[0].address == address


@pytest.mark.parametrize(
    ("worker", "words"),
    [
        ("takes_long_to_start", "it is starting"),
        ("never_says_welcome", "it took the connection and has not said Welcome yet"),
        ("speaks_versions_7_to_9", "of the protocol; this process speaks"),
    ],
)
def test_one_that_is_not_is_told_by_what_it_said(pool, start, worker, words):
    start(worker)
    wait_until(lambda: words in reason(pool))


def test_nobody_and_one_that_is_killed_are_no_connection(pool, start):
    assert reason(pool) == "there is no connection to it"
    process = start("serves_scenes")
    wait_until(lambda: not reason(pool))
    process.kill()
    wait_until(lambda: reason(pool) == "there is no connection to it")


@pytest.mark.slow
def test_one_that_hangs_is_missed_though_it_holds_no_call(pool, start):
    process = start("serves_scenes")
    wait_until(lambda: not reason(pool))
    process.send_signal(signal.SIGSTOP)
    wait_until(lambda: reason(pool) == "it answers no pings")
    process.send_signal(signal.SIGCONT)
    wait_until(lambda: not reason(pool))


@pytest.mark.slow
def test_one_that_came_later_is_watched_as_well(pool, address, start):
    start("serves_scenes")
    pool.add(f"{address}-later")
    later = start("serves_scenes", f"{address}-later")
    wait_until(lambda: all(standing.at_work for standing in pool.standings()))
    later.send_signal(signal.SIGSTOP)
    wait_until(lambda: [standing.at_work for standing in pool.standings()] == [True, False])
