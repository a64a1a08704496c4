"""Workers that hang, stand still, are slow, or start: who holds a call, and who gets the next one.

Setup: one or two workers in processes of their own. Fault: a signal, or a handler without end. Recovery: a call that
its worker does not answer is another's. Invariant: every call is answered, and with its own reply.
"""

import itertools
import random
import signal
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from protocol import Pool, Timeouts
from protocol.errors import DeadlineExceeded
from protocol.messages import Ping, Role, State
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.waiting import wait_until

pytestmark = pytest.mark.slow

LIVELY = Timeouts(call=30.0, startup=30.0, heartbeat=0.05, liveness=0.6, progress=60.0)
"""Notices silence soon, and nothing else."""

IMPATIENT = Timeouts(call=30.0, startup=30.0, heartbeat=0.05, liveness=60.0, progress=0.6)
"""Notices a handler that hangs soon, and nothing else."""


@pytest.fixture
def addresses(address) -> tuple[str, str]:
    return f"{address}-1", f"{address}-2"


def pool_of(addresses, timeouts: Timeouts) -> Pool:
    return Pool(addresses, role=Role.AGENT, serves=Role.RENDER, timeouts=timeouts)


def yaws(pool: Pool, seeds: range) -> list[float]:
    pending = [pool.submit(ask(seed)) for seed in seeds]
    return [one.result().scene.yaw for one in pending]


class TestStopped:
    """SIGSTOP: the connection stays, and nothing comes any more."""

    def test_what_it_holds_goes_to_another_and_it_is_used_again_once_it_goes_on(self, addresses, start):
        stopped, _ = (start("serves_scenes", at) for at in addresses)
        with pool_of(addresses, LIVELY) as pool:
            pool.wait_ready()
            stopped.send_signal(signal.SIGSTOP)
            assert yaws(pool, range(10)) == list(range(10))
            # Half of the calls, or less: a worker that answers while calls are still submitted holds fewer.
            lost = pool.statistics.losses
            assert 1 <= lost <= 5
            assert yaws(pool, range(10)) == list(range(10))
            assert pool.statistics.losses == lost, "a suspect was given calls"
            stopped.send_signal(signal.SIGCONT)
            wait_until(lambda: pool.statistics.late_replies == lost)
            answered = [pong.progress for pong in pool.ping()]
            assert yaws(pool, range(10)) == list(range(10))
            more = [pong.progress - count for pong, count in zip(pool.ping(), answered, strict=True)]
            assert sum(more) == 10
            assert min(more) > 0
            assert pool.statistics.losses == lost

    def test_without_another_it_answers_once_it_goes_on(self, address, start):
        stopped = start("serves_scenes")
        with client_of(address, LIVELY) as client:
            client.wait_ready()
            stopped.send_signal(signal.SIGSTOP)
            with pytest.raises(DeadlineExceeded, match=r"it answers no pings, and was heard .* s ago; does it hang\?"):
                client.call(ask(1), deadline=1.5)
            pending = client.submit(ask(2))
            stopped.send_signal(signal.SIGCONT)
            assert pending.result().scene.yaw == 2
            assert client.statistics.losses == 0

    def test_without_another_its_successor_answers(self, address, start):
        stopped = start("serves_scenes")
        with client_of(address, LIVELY) as client:
            client.wait_ready()
            stopped.send_signal(signal.SIGSTOP)
            pending = client.submit(ask(2))
            with pytest.raises(DeadlineExceeded):
                client.call(ask(1), deadline=1.5)
            stopped.kill()
            stopped.wait()
            start("serves_scenes")
            assert pending.result().scene.yaw == 2

    def test_what_only_it_can_answer_is_not_taken_from_it(self, addresses, start):
        stopped, _ = (start("serves_scenes", at) for at in addresses)
        with pool_of(addresses, LIVELY) as pool:
            pool.wait_ready()
            stopped.send_signal(signal.SIGSTOP)
            pending = pool._submit(Ping(), None, addresses[0], at_once=True)
            assert yaws(pool, range(10)) == list(range(10))
            stopped.send_signal(signal.SIGCONT)
            assert pending.result().state is State.READY


class TestStuck:
    """A handler without end: pings are answered, and nothing else."""

    def test_what_it_holds_goes_to_another_and_it_gets_no_more(self, addresses, start):
        for name, at in zip(("hangs_in_its_handler", "serves_scenes"), addresses, strict=True):
            start(name, at)
        with pool_of(addresses, IMPATIENT) as pool:
            pool.wait_ready()
            assert yaws(pool, range(10)) == list(range(10))
            assert yaws(pool, range(10)) == list(range(10))
            assert [pong.queue_depth for pong in pool.ping()] == [5, 0]
            assert pool.statistics.losses == 5

    def test_without_another_its_successor_answers(self, address, start):
        stuck = start("hangs_in_its_handler")
        with client_of(address, IMPATIENT) as client:
            client.wait_ready()
            pending = client.submit(ask(2))
            with pytest.raises(DeadlineExceeded, match="it answers pings, and none of its requests, and was heard"):
                client.call(ask(1), deadline=1.5)
            stuck.kill()
            stuck.wait()
            start("serves_scenes")
            assert pending.result().scene.yaw == 2

    def test_with_another_that_comes_later_it_is_the_later_one_that_answers(self, addresses, start):
        start("hangs_in_its_handler", addresses[0])
        with pool_of(addresses, IMPATIENT) as pool:
            pending = [pool.submit(ask(seed)) for seed in range(3)]
            wait_until(lambda: pool._ping(addresses[0]).queue_depth == 3)
            start("serves_scenes", addresses[1])
            assert [one.result().scene.yaw for one in pending] == [0, 1, 2]


def test_a_slow_worker_is_left_its_calls(addresses, start):
    """Each call takes a while, and all of them far longer than the clocks allow for one."""
    for at in addresses:
        start("serves_scenes", at)
    clocks = Timeouts(call=30.0, startup=30.0, heartbeat=0.05, liveness=2.0, progress=2.0)
    with pool_of(addresses, clocks) as pool:
        pool.wait_ready()
        assert yaws(pool, range(-150, -100)) == list(range(-150, -100))
        assert (pool.statistics.losses, pool.statistics.late_replies) == (0, 0)


def test_a_worker_that_starts_gets_no_call_while_another_is_ready(addresses, start):
    slow, ready = addresses
    start("takes_long_to_start", slow)
    start("serves_scenes", ready)
    with pool_of(addresses, PATIENT) as pool:
        wait_until(lambda: pool._ping(slow).state is State.STARTING)
        assert yaws(pool, range(20)) == list(range(20))
        assert pool._ping(slow).queue_depth == 0
        assert pool.statistics.losses == 0


def test_one_ready_worker_is_enough_to_begin(addresses, start):
    slow, ready = addresses
    start("takes_long_to_start", slow)
    with pool_of(addresses, PATIENT) as pool:
        pool._ping(slow)
        start("serves_scenes", ready)
        pool.wait_any_ready()
        assert pool._ping(slow).state is State.STARTING


def test_no_ready_worker_is_told_by_name(addresses, start):
    start("takes_long_to_start", addresses[0])
    with pool_of(addresses[:1], Timeouts(startup=1.0, heartbeat=0.05)) as pool:
        pool._ping(addresses[0])
        with pytest.raises(DeadlineExceeded, match=f"render at {addresses[0]} .* it is still starting"):
            pool.wait_any_ready()


@pytest.mark.parametrize("heartbeat", [0.05, 10.0])
def test_a_worker_restarted_within_one_ping_answers_what_its_predecessor_held(address, start, heartbeat):
    timeouts = Timeouts(call=30.0, startup=30.0, heartbeat=heartbeat)
    doomed = start("never_answers")
    with client_of(address, timeouts) as client:
        client.ping()
        pending = [client.submit(ask(seed)) for seed in range(5)]
        client.ping()
        doomed.kill()
        doomed.wait()
        start("serves_scenes")
        assert [one.result().scene.yaw for one in pending] == list(range(5))


class Trouble:
    """What can befall a pool's workers, drawn from a seed; one at a time, and never the last one alone."""

    def __init__(self, start, pool: Pool, seed: int) -> None:
        self._start = start
        self._pool = pool
        self._rng = random.Random(seed)
        self.workers = {address: start("serves_scenes", address) for address in pool.addresses}

    def befall(self) -> None:
        """Do one thing, and undo it."""
        address = self._rng.choice(sorted(self.workers))
        self._rng.choice([self.kill, self.stop, self.let_go])(address)

    def kill(self, address: str) -> None:
        self.workers[address].kill()
        self.workers[address].wait()
        self.workers[address] = self._start("serves_scenes", address)

    def stop(self, address: str) -> None:
        self.workers[address].send_signal(signal.SIGSTOP)
        time.sleep(self._rng.uniform(0.0, 1.0))
        self.workers[address].send_signal(signal.SIGCONT)

    def let_go(self, address: str) -> None:
        self._pool.remove(address)
        time.sleep(self._rng.uniform(0.0, 0.1))
        self._pool.add(address)


@pytest.mark.parametrize("seed", [1, 2])
def test_whatever_befalls_the_workers_every_call_gets_its_own_reply(address, start, seed):
    with pool_of([f"{address}-{number}" for number in range(3)], LIVELY) as pool:
        trouble = Trouble(start, pool, seed)
        pool.wait_ready()
        over = threading.Event()
        seeds = itertools.takewhile(lambda _: not over.is_set(), itertools.count())
        with ThreadPoolExecutor(1) as flying:
            flown = flying.submit(lambda: [reply.scene.yaw for reply in pool.map(map(ask, seeds))])
            for _ in range(12):
                trouble.befall()
                time.sleep(0.2)
            over.set()
            answers = flown.result()
        assert answers == list(range(len(answers)))
        assert pool.statistics.losses > 0
