"""Each job goes to one thread, in order, and to the one whose caches are warm."""

import itertools
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from protocol.server.jobs import Jobs
from tests.protocol.processes.waiting import wait_until


def idle_threads(jobs: Jobs[int], got: list[tuple[str, int]], names: str) -> list[threading.Thread]:
    """Threads that take one job each, and that have begun to wait in the order of their names."""
    threads: list[threading.Thread] = []
    for number, name in enumerate(names, 1):
        thread = threading.Thread(target=lambda name=name: got.append((name, jobs.get())), daemon=True)
        thread.start()
        wait_until(lambda number=number: len(jobs._idle) == number)
        threads.append(thread)
    return threads


def test_jobs_come_in_order_and_once():
    jobs: Jobs[int] = Jobs()
    for number in range(3):
        jobs.put(number)
    assert [jobs.get(), jobs.get()] == [0, 1]
    assert jobs.take_all() == [2]
    assert jobs.take_all() == []


def test_the_thread_that_was_at_work_last_gets_the_next_job():
    jobs: Jobs[int] = Jobs()
    got: list[tuple[str, int]] = []
    threads = idle_threads(jobs, got, "abc")
    for number in range(3):
        jobs.put(number)
        threads.pop().join(20)
    assert got == [("c", 0), ("b", 1), ("a", 2)]


def test_nothing_is_lost_between_threads():
    jobs: Jobs[int | None] = Jobs()

    def take_until_the_end(_: int) -> list[int]:
        return list(iter(jobs.get, None))

    with ThreadPoolExecutor(3) as threads:
        taken = threads.map(take_until_the_end, range(3))
        for number in range(20_000):
            jobs.put(number)
        for _ in range(3):
            jobs.put(None)
        assert sorted(itertools.chain.from_iterable(taken)) == list(range(20_000))


def test_a_thread_that_a_signal_ends_gets_no_job():
    jobs: Jobs[int] = Jobs()
    before = signal.signal(signal.SIGUSR1, lambda *_: pytest.fail("a signal"))
    try:
        interrupting = threading.Timer(0.1, signal.pthread_kill, [threading.main_thread().ident, signal.SIGUSR1])
        interrupting.start()
        with pytest.raises(pytest.fail.Exception, match="a signal"):
            jobs.get()
        interrupting.join()
    finally:
        signal.signal(signal.SIGUSR1, before)
    jobs.put(1)
    assert jobs.take_all() == [1]
