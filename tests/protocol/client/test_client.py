"""Every call ends by its deadline, with its own reply or a typed error, for every behaviour of the worker."""

import itertools
import math
import threading
import time
from concurrent.futures import Future, InvalidStateError, ThreadPoolExecutor

import pytest
import zmq

from protocol import Client, Limits, Pending, Timeouts
from protocol.camera import Camera, Intrinsics
from protocol.errors import (
    AddressUnavailable,
    ClientClosed,
    DeadlineExceeded,
    InvalidInput,
    LimitExceeded,
    Rejected,
    WorkerLost,
    WrongRole,
)
from protocol.messages import Perceive, Ping, Pong, Role, SampleScene, State
from protocol.pose_estimate import FilterState
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.serving import SCENES, serving
from tests.protocol.values.samples import CAMERA, picture
from tests.protocol.workers.scenes import scene_for


def test_a_call_returns_its_reply(address):
    with serving(address), client_of(address) as client:
        assert client.call(ask(3)).scene.yaw == 3


def test_ready_tells_who_answers(address):
    with serving(address, capabilities={"renderer": "opengl"}), client_of(address, serves=Role.RENDER) as client:
        welcome = client.wait_ready()
        assert (welcome.version, welcome.role, welcome.capabilities) == (1, Role.RENDER, {"renderer": "opengl"})
        assert client.ping().incarnation == welcome.incarnation


def test_a_call_made_before_its_worker_is_there_is_answered_when_it_comes(address):
    with client_of(address) as client:
        pending = client.submit(ask(4))
        with serving(address):
            assert pending.result().scene.yaw == 4


def test_tcp_carries_the_same(address):
    with zmq.Context() as context, context.socket(zmq.ROUTER) as free:
        port = free.bind_to_random_port("tcp://127.0.0.1")
    with serving(f"tcp://127.0.0.1:{port}"), client_of(f"tcp://localhost:{port}") as client:
        assert client.call(ask(5)).scene.yaw == 5


def test_many_calls_of_several_threads_each_get_their_own_reply(address):
    def call_all(client: Client, seeds: range) -> bool:
        pending = [client.submit(ask(seed)) for seed in seeds]
        return all(one.result().scene.yaw == seed for one, seed in zip(pending, seeds, strict=True))

    with serving(address, limits=Limits(queue=1000)), client_of(address) as client, ThreadPoolExecutor(2) as threads:
        ranges = [range(500), range(500, 1000)]
        assert all(threads.map(call_all, itertools.repeat(client), ranges))


def test_no_call_of_many_threads_sleeps_through_its_reply(address):
    """Callers and handlers send by themselves while the I/O threads wait; no message may be missed meanwhile."""

    def sample(request: SampleScene):
        time.sleep(request.seed % 7 / 5000)
        return scene_for(request.seed)

    def one_after_the_other(client: Client, seeds: range) -> bool:
        return all(client.call(ask(seed), deadline=25.0).scene.yaw == seed for seed in seeds)

    # A ping, or a deadline, would wake a thread that sleeps.
    never_pings = Timeouts(heartbeat=50.0)
    with (
        serving(address, {SampleScene: sample}, concurrency=4, timeouts=never_pings),
        client_of(address, timeouts=never_pings) as client,
        ThreadPoolExecutor(6) as threads,
    ):
        client.wait_ready()
        begun = time.monotonic()
        ranges = [range(start, start + 150) for start in range(0, 900, 150)]
        assert all(threads.map(one_after_the_other, itertools.repeat(client), ranges))
        assert client.statistics.retries == 0
        assert time.monotonic() - begun < 20


def test_a_call_can_be_made_when_another_ends(address):
    with serving(address), client_of(address) as client:
        then: Future[Pending] = Future()
        client.submit(ask(1)).add_done_callback(lambda _: then.set_result(client.submit(ask(2))))
        assert then.result(10).result(10).scene.yaw == 2


def test_more_calls_than_a_worker_takes_at_once_are_all_answered(address):
    def sample(request: SampleScene):
        time.sleep(0.002)
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}, limits=Limits(queue=2)), client_of(address) as client:
        pending = [client.submit(ask(seed)) for seed in range(100)]
        assert [one.result().scene.yaw for one in pending] == list(range(100))
        # Each is bounced once, in the first rush; after that the client knows how many the worker takes.
        assert 0 < client.statistics.retries < 200


def test_map_keeps_the_order_and_a_bound(address):
    handed_out = 0
    most = 0

    def requests():
        nonlocal handed_out
        for seed in range(30):
            handed_out += 1
            yield ask(seed)

    with serving(address), client_of(address, limits=Limits(under_way=4)) as client:
        yaws = []
        for reply in client.map(requests()):
            yaws.append(reply.scene.yaw)
            most = max(most, handed_out - len(yaws))
    assert yaws == list(range(30))
    assert most <= 4


def test_a_map_that_is_left_cancels_what_is_under_way(address):
    made: list[Pending] = []

    class Recording(Client):
        def submit(self, request, *, deadline=None):
            made.append(super().submit(request, deadline=deadline))
            return made[-1]

    def sample(request: SampleScene):
        go_on.wait(20)
        return scene_for(request.seed)

    go_on = threading.Event()
    with serving(address, {SampleScene: sample}), Recording(address, role=Role.AGENT) as client:
        replies = client.map(itertools.chain([Ping()], map(ask, itertools.count())))
        assert isinstance(next(replies), Pong)
        replies.close()
        assert len(made) > 1
        assert all(pending.cancelled() for pending in made[1:])
        go_on.set()


def test_a_call_that_is_cancelled_before_its_worker_is_there_is_not_sent(address):
    seeds = []

    def sample(request: SampleScene):
        seeds.append(request.seed)
        return scene_for(request.seed)

    with client_of(address) as client:
        assert client.submit(ask(1)).cancel()
        with serving(address, {SampleScene: sample}):
            assert client.call(ask(2)).scene.yaw == 2
    assert seeds == [2]


def test_timing_tells_where_the_time_went(address):
    both_are_there = threading.Event()

    def sample(request: SampleScene):
        both_are_there.wait(20)
        time.sleep(0.02)
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}), client_of(address) as client:
        first, second = client.submit(ask(1)), client.submit(ask(2))
        while client.ping().queue_depth < 2:
            pass
        both_are_there.set()
        with pytest.raises(InvalidStateError):
            _ = second.timing
        first.result()
        second.result()
        assert second.timing.compute >= 0.02
        assert second.timing.queue >= 0.02
        parts = second.timing.queue + second.timing.compute + second.timing.transport
        assert math.isclose(parts, second.timing.wall)
        assert second.timing.transport > 0


def test_nobody_at_the_address_is_told_as_such(address):
    with client_of(address) as client, pytest.raises(DeadlineExceeded) as caught:
        client.call(ask(1), deadline=0.1)
    assert str(caught.value) == (
        f"worker at {address} did not answer SampleScene within 0.1 s (0 tries); "
        "is it running? See 'orchestrator status'"
    )


def test_a_deadline_that_has_passed_ends_the_call_at_once(address):
    with serving(address), client_of(address) as client, pytest.raises(DeadlineExceeded):
        client.call(ask(1), deadline=-1.0)


@pytest.mark.parametrize("deadline", [math.nan, math.inf, 1e11])
def test_a_deadline_is_finite(address, deadline):
    with client_of(address) as client, pytest.raises(InvalidInput, match="a deadline is a number of seconds"):
        client.submit(ask(1), deadline=deadline)


def test_a_worker_of_another_role_is_a_typed_error(address):
    with serving(address, role=Role.PERCEPTION), client_of(address, serves=Role.RENDER) as client:
        with pytest.raises(WrongRole, match=f"the worker at {address} serves perception, not render"):
            client.wait_ready()
        with pytest.raises(WrongRole):
            client.call(ask(1))


@pytest.mark.slow
def test_a_start_that_takes_too_long_is_told_as_such(address):
    release = threading.Event()

    def load():
        release.wait()
        return SCENES

    with serving(address, load), client_of(address, Timeouts(startup=0.3, heartbeat=0.05)) as client:
        with pytest.raises(DeadlineExceeded, match=r"not ready within 0\.3 s"):
            client.wait_ready()
        assert client.ping().state is State.STARTING
        with pytest.raises(DeadlineExceeded, match="it is still starting; allow it more time"):
            client.call(ask(1), deadline=0.2)
        release.set()
        assert client.call(ask(2)).scene.yaw == 2


def test_a_failure_that_may_pass_is_tried_again(address):
    tries = itertools.count(1)

    def sample(request: SampleScene):
        if next(tries) < 3:
            raise WorkerLost("the renderer is gone")
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}), client_of(address) as client:
        assert client.call(ask(6)).scene.yaw == 6
        assert client.statistics.retries == 2


@pytest.mark.slow
def test_a_failure_that_does_not_pass_is_named_at_the_deadline(address):
    def sample(request: SampleScene):
        raise WorkerLost("the renderer is gone")

    named = r"tries; the last one failed: worker-lost: the renderer is gone\)"
    with (
        serving(address, {SampleScene: sample}),
        client_of(address) as client,
        pytest.raises(DeadlineExceeded, match=named),
    ):
        client.call(ask(6), deadline=0.5)


def test_a_failure_for_good_is_raised_with_its_code(address):
    def sample(request: SampleScene):
        raise InvalidInput("no such split")

    with serving(address, {SampleScene: sample}), client_of(address) as client:
        with pytest.raises(Rejected, match=r"rejected SampleScene \(invalid-input\): no such split") as caught:
            client.call(ask(6))
        assert (caught.value.code, caught.value.retryable) == ("invalid-input", False)
        assert client.statistics.retries == 0


def test_what_is_too_large_is_refused_before_it_is_sent(address):
    with client_of(address, limits=Limits(array_bytes=100)) as client, pytest.raises(LimitExceeded):
        client.submit(Perceive(frame=picture(), filter=FilterState.initial()))


def test_a_call_larger_than_the_worker_takes_is_rejected_and_others_go_on(address):
    with serving(address, limits=Limits(message_bytes=1000)), client_of(address) as client:
        with pytest.raises(Rejected, match="limit-exceeded"):
            client.call(Perceive(frame=picture(), filter=FilterState.initial()))
        assert client.call(ask(1)).scene.yaw == 1


@pytest.mark.slow
def test_a_part_that_the_socket_refuses_loses_that_call_and_no_other(address):
    limits = Limits(header_bytes=1000, body_bytes=1000, array_bytes=1000)
    large_frame = picture(Camera(CAMERA.pose, Intrinsics.from_horizontal_fov(40, 30, 70)))
    with serving(address, limits=limits), client_of(address) as client:
        large = client.submit(Perceive(frame=large_frame, filter=FilterState.initial()), deadline=1.0)
        assert client.call(ask(1)).scene.yaw == 1
        with pytest.raises((WorkerLost, DeadlineExceeded)):
            large.result()
        assert client.call(Ping()).state is State.READY


@pytest.mark.parametrize("address", ["", "nowhere", "udp://127.0.0.1:1", "tcp://127.0.0.1", "tcp://*:5555", "ipc://"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(AddressUnavailable):
        client_of(address)


def test_a_mistake_of_the_client_s_own_ends_every_call_and_leaves_none_waiting(address, caplog):
    def mistaken(call):
        raise RuntimeError("a mistake")

    with serving(address), client_of(address) as client:
        client.wait_ready()
        (connection,) = client._dispatcher._connections
        connection.send = mistaken
        with pytest.raises(ClientClosed, match="a mistake"):
            client.call(ask(1))
        with pytest.raises(ClientClosed, match="a mistake"):
            client.call(ask(2))
    assert "the client's I/O thread failed" in caplog.text
