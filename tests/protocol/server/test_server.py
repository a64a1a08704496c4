"""A worker answers every message, while it starts, computes and drains."""

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
import pytest
import zmq

from protocol import Limits, serve
from protocol.codec import encode, seal
from protocol.errors import AddressUnavailable, ArtifactMissing, InvalidInput, Rejected
from protocol.header import ReplyHeader, RequestHeader
from protocol.messages import (
    Drain,
    Drained,
    Failure,
    Hello,
    Observe,
    Ping,
    Pong,
    Render,
    Role,
    Sampled,
    SampleScene,
    State,
    Welcome,
)
from protocol.pose_estimate import FilterState
from protocol.server import listener
from protocol.transport.sockets import send
from tests.protocol.processes.bare_client import BareClient, bare_client
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.serving import SCENES, serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.values.samples import CAMERA, SCENE, picture
from tests.protocol.workers.scenes import scene_for


class Held:
    """A handler that tells when it has begun, and waits until it may end."""

    def __init__(self) -> None:
        self.seeds: list[int] = []
        self.begun = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)

    @property
    def handlers(self):
        return {SampleScene: self.sample}

    def sample(self, request: SampleScene) -> Sampled:
        self.seeds.append(request.seed)
        self.begun.release()
        self.may_end.acquire(timeout=20)
        return scene_for(request.seed)


def pong_of(client: BareClient) -> Pong:
    client.ask(Ping(), 99)
    _, pong = client.receive()
    return pong


def test_a_frame_crosses_whole(address):
    with serving(address, {Render: lambda request: picture(request.camera)}), client_of(address) as client:
        frame = client.call(Render(scene=SCENE, camera=CAMERA))
        assert frame.rgb.tobytes() == picture().rgb.tobytes()
        assert not frame.depth.flags.writeable


def test_pings_are_answered_while_a_handler_computes(address):
    held = Held()
    with serving(address, held.handlers), bare_client(address) as client:
        for number in range(3):
            client.ask(ask(number), number)
        held.begun.acquire(timeout=20)
        busy = pong_of(client)
        assert (busy.state, busy.queue_depth, busy.progress) == (State.BUSY, 3, 0)
        for number in range(3):
            held.may_end.release()
            assert client.receive()[0].request == number
        idle = pong_of(client)
        assert (idle.state, idle.queue_depth, idle.progress) == (State.READY, 0, 3)
        assert idle.resident_bytes > 1_000_000
        assert idle.incarnation == busy.incarnation


def test_a_worker_that_starts_says_so_and_keeps_what_comes(address):
    release = threading.Event()

    def load():
        release.wait(20)
        return SCENES

    with serving(address, load), bare_client(address) as client:
        client.ask(Hello(role=Role.AGENT, incarnation="x"), 1)
        assert isinstance(client.receive()[1], Welcome)
        client.ask(ask(5), 2)
        assert pong_of(client).state is State.STARTING
        release.set()
        header, reply = client.receive()
        assert (header.request, reply.scene.yaw) == (2, 5.0)
        assert header.queue > 0


def test_a_worker_that_can_not_start_refuses_what_waits_and_says_why(address):
    release = threading.Event()
    raised = []

    def load():
        release.wait(20)
        raise ArtifactMissing("bodies.npz is missing")

    def run():
        try:
            serve(load, role=Role.RENDER, bind=address)
        except ArtifactMissing as error:
            raised.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    with bare_client(address) as client:
        client.ask(ask(5))
        pong_of(client)
        release.set()
        _, refusal = client.receive()
        assert (refusal.code, refusal.retryable) == ("draining", True)
    thread.join()
    assert [str(error) for error in raised] == ["bodies.npz is missing"]


def test_concurrency_runs_that_many_handlers_at_once(address):
    meet = threading.Barrier(3)

    def sample(request: SampleScene) -> Sampled:
        meet.wait(20)
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}, concurrency=3), client_of(address) as client:
        assert [reply.scene.yaw for reply in client.map(map(ask, range(3)))] == [0, 1, 2]


def test_a_request_that_no_handler_is_for_is_unsupported(address):
    with serving(address), client_of(address) as client:
        with pytest.raises(Rejected, match="this worker does not answer Observe") as caught:
            client.call(Observe(scene=SCENE, camera=CAMERA, filter=FilterState.initial()))
        assert caught.value.code == "unsupported"


def test_a_reply_sent_to_a_worker_is_no_request(address):
    with serving(address), bare_client(address) as client:
        header = RequestHeader(1, "bare", 1.0)
        client.send([bytes(part) for part in seal(encode(Drained(), Limits()), header)])
        assert client.receive()[1].message == "Drained is not a request"


@pytest.mark.parametrize(
    ("handler", "message"),
    [
        (lambda request: 1 / 0, "ZeroDivisionError: division by zero"),
        (lambda request: None, "the handler of SampleScene did not return a Sampled"),
        (lambda request: Drained(), "the handler of SampleScene did not return a Sampled"),
        (lambda request: Sampled(scene=1j), "the reply can't be sent: a complex can't be sent"),
    ],
    ids=["raises", "returns none", "returns another reply", "returns what does not travel"],
)
def test_a_handler_with_a_mistake_is_an_internal_failure_and_the_worker_goes_on(address, handler, message, caplog):
    with serving(address, {SampleScene: handler}), client_of(address) as client:
        for _ in range(2):
            with pytest.raises(Rejected) as caught:
                client.call(ask(1))
            assert (caught.value.code, caught.value.retryable) == ("internal", False)
            assert message in str(caught.value)
    assert any(record.levelname == "ERROR" for record in caplog.records)


def test_a_queue_that_is_full_refuses_for_the_moment(address):
    held = Held()
    with serving(address, held.handlers, limits=Limits(queue=2)), bare_client(address) as client:
        for number in range(3):
            client.ask(ask(number), number)
        header, refusal = client.receive()
        assert (header.request, refusal.code, refusal.retryable) == (2, "overloaded", True)
        held.may_end.release(2)
        assert [client.receive()[0].request for _ in range(2)] == [0, 1]


def test_a_request_whose_deadline_passed_in_the_queue_is_not_computed(address):
    held = Held()
    with serving(address, held.handlers), bare_client(address) as client:
        client.ask(ask(1), 1)
        held.begun.acquire(timeout=20)
        client.ask(ask(2), 2, deadline=0.0)
        client.ask(ask(3), 3)
        held.may_end.release(2)
        replies = {header.request: reply for header, reply in (client.receive() for _ in range(3))}
    assert held.seeds == [1, 3]
    assert replies[2].code == "deadline-exceeded"


def test_a_handler_that_calls_another_worker_inherits_the_deadline(address):
    behind = f"{address}-behind"
    held = Held()
    with serving(behind, held.handlers), client_of(behind) as inner:

        def sample(request: SampleScene) -> Sampled:
            return inner.call(request, deadline=60.0)

        with serving(address, {SampleScene: sample}), bare_client(address) as client:
            client.ask(ask(1), deadline=0.1)
            _, failure = client.receive()
        assert (failure.code, failure.retryable) == ("deadline-exceeded", True)
        assert f"{behind} did not answer SampleScene within 0." in failure.message
        held.may_end.release()


def _hello_parts() -> list[bytes]:
    parts = seal(encode(Hello(role=Role.AGENT, incarnation="x"), Limits()), RequestHeader(7, "x", 1.0))
    return [bytes(part) for part in parts]


PRELUDE, HEADER, BODY = _hello_parts()
REPLY_HEADER = msgspec.msgpack.encode(ReplyHeader(7, "x"))


@pytest.mark.parametrize(
    ("parts", "code"),
    [
        ([b""], None),
        ([b"GET / HTTP/1.1\r\n\r\n"], None),
        ([PRELUDE], None),
        ([PRELUDE, HEADER], "malformed-message"),
        ([PRELUDE, b"\xff", BODY], None),
        ([PRELUDE, REPLY_HEADER, BODY], None),
        ([PRELUDE[:3], HEADER, BODY], "malformed-message"),
        ([PRELUDE, HEADER, b"\xc1"], "malformed-message"),
        ([PRELUDE, HEADER, BODY, b"more"], "malformed-message"),
        ([PRELUDE, HEADER, BODY, *[b""] * 50], "limit-exceeded"),
        ([PRELUDE, HEADER, bytes(2**20 + 1)], "limit-exceeded"),
        ([b"\x01\x00\xff\xff", HEADER, BODY], "malformed-message"),
        ([b"\x09\x00\x03\x00", HEADER, b"\x80"], "version-mismatch"),
    ],
)
def test_garbage_is_counted_and_answered_where_it_can_be(address, parts, code):
    with serving(address), bare_client(address) as client:
        client.send(parts)
        assert pong_of_after_failure(client, code).malformed == 1
        client.ask(ask(3), 8)
        assert client.receive()[1].scene.yaw == 3


def pong_of_after_failure(client: BareClient, code: str | None) -> Pong:
    if code is not None:
        header, failure = client.receive()
        assert (header.request, failure.code, failure.retryable) == (7, code, False)
    return pong_of(client)


def test_a_part_that_is_too_large_ends_its_connection_and_nothing_else(address):
    limits = Limits(header_bytes=10_000, body_bytes=10_000, array_bytes=10_000)
    with serving(address, limits=limits), bare_client(address) as client, bare_client(address) as other:
        client.send([PRELUDE, HEADER, bytes(10_001)])
        other.ask(ask(3))
        assert other.receive()[1].scene.yaw == 3


def test_what_follows_no_protocol_at_all_harms_nobody(address):
    with zmq.Context() as context, context.socket(zmq.STREAM) as raw, serving(address):
        raw.setsockopt(zmq.LINGER, 0)
        raw.connect(address)
        identity, _ = raw.recv_multipart()
        raw.send_multipart([identity, b"\x00" * 1000])
        with client_of(address) as client:
            assert client.call(ask(3)).scene.yaw == 3


@pytest.mark.parametrize(("oldest", "newest"), [(7, 9), (-3, 0)])
def test_a_client_without_a_common_version_is_told(address, oldest, newest):
    with serving(address), bare_client(address) as client:
        client.ask(
            Hello(oldest_version=oldest, newest_version=newest, role=Role.AGENT, incarnation="x"),
            version=max(newest, 0),
        )
        _, failure = client.receive()
    assert isinstance(failure, Failure)
    assert (failure.code, failure.retryable) == ("version-mismatch", False)
    assert f"it speaks versions 1 to 1 of the protocol, the other side {oldest} to {newest}" in failure.message


def test_a_client_that_speaks_more_versions_agrees_on_a_common_one(address):
    with serving(address), bare_client(address) as client:
        client.ask(Hello(oldest_version=1, newest_version=9, role=Role.AGENT, incarnation="x"), version=9)
        assert client.receive()[1].version == 1


def test_draining_finishes_what_is_in_hand_and_takes_no_more(address):
    held = Held()
    thread = threading.Thread(
        target=serve, args=(lambda: held.handlers,), kwargs={"role": Role.RENDER, "bind": address}
    )
    thread.start()
    with bare_client(address) as client:
        client.ask(ask(1), 1)
        client.ask(ask(2), 2)
        held.begun.acquire(timeout=20)
        client.ask(Drain(), 3)
        client.ask(ask(4), 4)
        header, refusal = client.receive()
        assert (header.request, refusal.code, refusal.retryable) == (4, "draining", True)
        assert pong_of(client).state is State.DRAINING
        held.may_end.release(2)
        numbers = [client.receive()[0].request for _ in range(3)]
    thread.join()
    assert numbers == [1, 2, 3]
    assert not Path(address.removeprefix("ipc://")).exists()


def test_an_address_in_use_is_told(address):
    with serving(address), pytest.raises(AddressUnavailable, match="is in use; stop the worker there"):
        serve(lambda: SCENES, role=Role.RENDER, bind=address)


def test_a_port_in_use_is_told():
    with zmq.Context() as context, context.socket(zmq.ROUTER) as taken:
        port = taken.bind_to_random_port("tcp://127.0.0.1")
        with pytest.raises(AddressUnavailable, match=f":{port} is in use; stop the process that serves there"):
            serve(lambda: SCENES, role=Role.RENDER, bind=f"tcp://127.0.0.1:{port}")


@pytest.mark.parametrize("concurrency", [0, -1])
def test_a_worker_has_a_handler_thread(address, concurrency):
    with pytest.raises(InvalidInput, match="one handler thread or more"):
        serve(lambda: SCENES, role=Role.RENDER, bind=address, concurrency=concurrency)


def test_a_client_that_never_reads_costs_the_others_nothing(address):
    with serving(address, limits=Limits(queue=10_000)), bare_client(address) as silent, client_of(address) as client:
        for number in range(2000):
            silent.ask(Ping(), number)
        assert [reply.scene.yaw for reply in client.map(map(ask, range(20)))] == list(range(20))


@pytest.mark.skipif(sys.platform != "linux", reason="only there a priority belongs to a thread")
@pytest.mark.parametrize("computes", [True, False])
def test_only_handlers_that_compute_let_others_go_first(address, computes):
    seen = []

    def sample(request: SampleScene) -> Sampled:
        seen.append(os.getpriority(os.PRIO_PROCESS, threading.get_native_id()))
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}, computes=computes), client_of(address) as client:
        client.call(ask(1))
    usual = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    assert seen == [max(10, usual) if computes else usual]


@pytest.mark.timeout(60)
def test_a_mistake_while_a_handler_sends_ends_the_worker_with_it(address, monkeypatch, caplog):
    def mistaken(socket, parts):
        if threading.current_thread().name.startswith("handling"):
            raise RuntimeError("a mistake")
        return send(socket, parts)

    monkeypatch.setattr(listener, "send", mistaken)
    with ThreadPoolExecutor(1, "handling") as threads, client_of(address) as client:
        worker = threads.submit(serve, lambda: SCENES, role=Role.RENDER, bind=address)
        client.wait_ready()
        # What is answered while the listener's thread is at work, that thread sends; so it may take more than one.
        while not worker.done():
            pending = client.submit(ask(1), deadline=20)
            wait_until(lambda pending=pending: worker.done() or pending.done())
            pending.cancel()
        with pytest.raises(RuntimeError, match="a mistake"):
            worker.result()
    assert "the worker's I/O thread failed" in caplog.text
