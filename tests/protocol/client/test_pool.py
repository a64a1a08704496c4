"""Calls are spread over workers, and a worker's end is another's work."""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, wait
from contextlib import ExitStack

import pytest
from msgspec.structs import replace

from protocol import Limits, Pool
from protocol.client.pool import lacking
from protocol.errors import AddressUnavailable, DeadlineExceeded, InvalidInput, Rejected, WorkerLost, WrongRole
from protocol.messages import Role, SampleScene, State
from tests.protocol.processes.calls import PATIENT, ask
from tests.protocol.processes.serving import serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.workers.scenes import scene_for


@pytest.fixture
def addresses(address: str) -> tuple[str, str]:
    return f"{address}-1", f"{address}-2"


def pool_of(addresses, **options) -> Pool:
    return Pool(addresses, role=Role.AGENT, serves=Role.RENDER, **{"timeouts": PATIENT, **options})


class Tally:
    """Handlers that count, and can be held up."""

    def __init__(self) -> None:
        self.answered = 0
        self.may_go_on = threading.Event()
        self.may_go_on.set()

    def handlers(self):
        return {SampleScene: self.sample}

    def sample(self, request: SampleScene):
        self.may_go_on.wait()
        self.answered += 1
        return scene_for(request.seed)


@pytest.fixture
def tallies(addresses) -> Iterator[tuple[Tally, Tally]]:
    with ExitStack() as stack:
        tallies = Tally(), Tally()
        for address, tally in zip(addresses, tallies, strict=True):
            stack.enter_context(serving(address, tally.handlers()))
        yield tallies
        for tally in tallies:
            tally.may_go_on.set()


def test_calls_one_after_the_other_take_turns(addresses, tallies):
    with pool_of(addresses) as pool:
        pool.wait_ready()
        for seed in range(10):
            assert pool.call(ask(seed)).scene.yaw == seed
    assert [tally.answered for tally in tallies] == [5, 5]


def test_a_call_that_is_sent_at_once_does_not_wake_the_client_s_thread(address):
    tally = Tally()
    seldom_pinged = replace(PATIENT, heartbeat=15.0)
    with serving(address, tally.handlers()), pool_of([address], timeouts=seldom_pinged) as pool:
        pool.wait_ready()
        pool.call(ask(0))
        tally.may_go_on.clear()
        # The thread may still be at work on the last reply.
        time.sleep(0.2)
        before = pool.turns
        pending = pool.submit(ask(1))
        time.sleep(0.2)
        assert pool.turns == before
        tally.may_go_on.set()
        assert pending.result().scene.yaw == 1


def test_a_call_goes_to_the_worker_with_the_fewest_in_hand(addresses, tallies):
    held, free = tallies
    held.may_go_on.clear()
    with pool_of(addresses) as pool:
        pool.wait_ready()
        pending = [pool.submit(ask(seed)) for seed in range(2)]
        wait(pending, return_when=FIRST_COMPLETED)
        for seed in range(9):
            pool.call(ask(seed))
        assert (held.answered, free.answered) == (0, 10)
        held.may_go_on.set()
        assert [one.result().scene.yaw for one in pending] == [0, 1]


def test_a_pool_tells_of_all_its_workers(addresses, tallies):
    with pool_of(addresses) as pool:
        assert len({welcome.incarnation for welcome in pool.wait_ready()}) == 2
        assert [pong.state for pong in pool.ping()] == [State.READY, State.READY]


def test_a_map_uses_all_workers_and_keeps_the_order(addresses, tallies):
    with pool_of(addresses, limits=Limits(under_way=2)) as pool:
        pool.wait_ready()
        assert [reply.scene.yaw for reply in pool.map(ask(seed) for seed in range(40))] == list(range(40))
    assert all(tally.answered > 0 for tally in tallies)


def test_a_worker_that_ends_leaves_its_calls_to_the_other(addresses):
    first, second = addresses
    with serving(second), pool_of(addresses) as pool:
        with serving(first):
            pool.wait_ready()
        assert [pool.call(ask(seed)).scene.yaw for seed in range(10)] == list(range(10))


def test_a_refusal_is_taken_to_another_worker(addresses):
    first, second = addresses
    refuse = Tally()

    def sample(request: SampleScene):
        refuse.answered += 1
        raise Rejected("not now", code="overloaded", retryable=True)

    with serving(first, {SampleScene: sample}), serving(second), pool_of(addresses) as pool:
        pool.wait_ready()
        assert [pool.call(ask(seed)).scene.yaw for seed in range(4)] == list(range(4))
    assert 0 < refuse.answered <= 4


def test_a_worker_of_another_role_is_left_out(addresses):
    first, second = addresses
    with serving(first, role=Role.PERCEPTION), serving(second), pool_of(addresses) as pool:
        assert [pool.call(ask(seed)).scene.yaw for seed in range(4)] == list(range(4))
        with pytest.raises(WrongRole):
            pool.wait_ready()


def test_a_pool_of_workers_of_another_role_is_a_typed_error(addresses):
    first, second = addresses
    with (
        serving(first, role=Role.PERCEPTION),
        serving(second, role=Role.PERCEPTION),
        pool_of(addresses) as pool,
        pytest.raises(WrongRole),
    ):
        pool.call(ask(1))


def test_a_pool_that_reaches_no_worker_names_all_its_addresses(addresses):
    first, second = addresses
    with pool_of(addresses) as pool, pytest.raises(DeadlineExceeded, match=f"render at {first} or render at {second}"):
        pool.call(ask(1), deadline=0.1)


def test_no_address_is_in_a_pool_twice():
    with pytest.raises(InvalidInput, match="different addresses"):
        pool_of(("ipc:///a", "ipc:///a"))


def test_a_pool_without_workers_says_so_at_the_deadline():
    with pool_of(()) as pool, pytest.raises(DeadlineExceeded, match="no worker is known that could answer SampleScene"):
        pool.call(ask(1), deadline=0.1)


class TestParents:
    """Workers that call others: they get calls, and report when they know no worker to call."""

    @pytest.fixture
    def child(self, address) -> str:
        return f"{address}-child"

    @pytest.fixture
    def parents(self, addresses, child) -> Iterator[Pool]:
        """Two workers that call render workers: the first knows none, the second knows one, which may not run."""
        with (
            pool_of([]) as none,
            pool_of([child]) as children,
            serving(addresses[0], role=Role.PERCEPTION, calls={Role.RENDER: none}),
            serving(addresses[1], role=Role.PERCEPTION, calls={Role.RENDER: children}),
            Pool(addresses, role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENT) as pool,
        ):
            pool.monitor()
            yield pool

    @pytest.mark.slow
    def test_one_without_children_is_not_at_work_for_its_own_parent(self, parents, child):
        def standings() -> list[tuple[bool, str]]:
            return [(one.at_work, one.reason) for one in parents.standings()]

        lonely = (False, "it waits for render")
        wait_until(lambda: standings() == [lonely, lonely])
        with serving(child):
            wait_until(lambda: standings() == [lonely, (True, "")])
        wait_until(lambda: standings() == [lonely, lonely])
        assert [pong.lacks for pong in parents.ping()] == [(Role.RENDER,), (Role.RENDER,)]
        assert lacking({Role.PERCEPTION: parents}) == (Role.PERCEPTION,)

    @pytest.mark.slow
    def test_one_without_children_is_asked_last(self, parents, child, addresses):
        with serving(child):
            wait_until(lambda: [one.at_work for one in parents.standings()] == [False, True])
            for seed in range(4):
                parents.call(ask(seed))
            answered = [pong.progress for pong in parents.ping()]
        assert answered == [0, 4]

    def test_one_without_children_is_asked_where_there_is_no_other(self, parents):
        assert parents.call(ask(3)).scene.yaw == 3


def test_a_call_that_waits_in_an_empty_pool_goes_to_the_first_worker_that_comes(addresses, tallies):
    with pool_of(()) as pool:
        pending = pool.submit(ask(3))
        pool.add(addresses[0])
        assert pending.result().scene.yaw == 3


def test_a_worker_that_is_added_takes_its_share(addresses, tallies):
    first, second = addresses
    with pool_of((first,)) as pool:
        pool.wait_ready()
        pool.add(second)
        pool.add(second)
        assert pool.addresses == (first, second)
        pool.wait_ready()
        for seed in range(10):
            assert pool.call(ask(seed)).scene.yaw == seed
    assert [tally.answered for tally in tallies] == [5, 5]


def test_what_is_no_address_is_not_added(addresses):
    with pool_of(addresses) as pool:
        with pytest.raises(AddressUnavailable):
            pool.add("nowhere")
        assert pool.addresses == addresses


def test_what_a_worker_holds_that_is_removed_goes_to_another(addresses, tallies):
    held, free = tallies
    held.may_go_on.clear()
    with pool_of(addresses) as pool:
        pool.wait_ready()
        pending = [pool.submit(ask(seed)) for seed in range(6)]
        pool.remove(addresses[0])
        assert pool.addresses == addresses[1:]
        assert [one.result().scene.yaw for one in pending] == list(range(6))
        assert [pool.call(ask(seed)).scene.yaw for seed in range(4)] == list(range(4))
        assert (held.answered, free.answered) == (0, 10)
        assert pool.statistics.losses == 0


def test_a_question_to_a_worker_that_is_removed_ends(addresses):
    with pool_of(addresses) as pool:
        pool.remove(addresses[0])
        pool.remove(addresses[1])
        with pytest.raises(WorkerLost, match=f"{addresses[0]} was removed before it answered Ping"):
            pool._ping(addresses[0])


@pytest.mark.slow
def test_what_a_killed_worker_held_goes_to_the_other_at_once(addresses, start):
    first, second = addresses
    doomed = start("never_answers", first)
    with serving(second), pool_of(addresses) as pool:
        pool.wait_ready()
        pending = [pool.submit(ask(seed)) for seed in range(10)]
        pool.ping()
        doomed.kill()
        assert [one.result().scene.yaw for one in pending] == list(range(10))
        assert pool.statistics.losses > 0
