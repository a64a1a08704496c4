"""An observer is told what came of each request, and of nothing else."""

import threading

import pytest

from protocol import Limits, serve
from protocol.errors import InvalidInput, Rejected
from protocol.messages import Drain, Failure, Render, Role, Sampled, SampleScene
from protocol.observer import Finished, Observed
from tests.protocol.processes.bare_client import bare_client
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.serving import serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.values.samples import CAMERA, SCENE, picture
from tests.protocol.workers.scenes import scene_for


class Notes:
    """Writes down what it is told."""

    def __init__(self) -> None:
        self.workers: list[Observed] = []
        self.requests: list[Finished] = []

    def attend(self, worker: Observed) -> None:
        self.workers.append(worker)

    def finished(self, request: Finished) -> None:
        self.requests.append(request)

    def told(self) -> list[tuple[str, str, str]]:
        return [(one.request, one.outcome.value, one.code) for one in self.requests]


@pytest.fixture
def notes() -> Notes:
    return Notes()


def test_handshakes_pings_and_drains_are_no_requests(address, notes):
    with serving(address, observer=notes), client_of(address) as client:
        client.wait_ready()
        client.call(ask(1))
        assert notes.workers[0].pong().incarnation == client.ping().incarnation
        wait_until(lambda: notes.requests)
    assert notes.told() == [("SampleScene", "answered", "")]
    (finished,) = notes.requests
    assert finished.queue is not None
    assert finished.compute is not None


def test_a_reply_that_can_not_be_sent_has_failed(address, notes):
    limits = Limits(array_bytes=100)
    handlers = {Render: lambda request: picture(request.camera)}
    with serving(address, handlers, observer=notes, limits=limits), client_of(address) as client:
        with pytest.raises(Rejected, match="can't be sent"):
            client.call(Render(scene=SCENE, camera=CAMERA))
        wait_until(lambda: notes.requests)
    assert notes.told() == [("Render", "failed", "internal")]


def test_a_handler_that_raises_has_failed_with_its_code(address, notes):
    def sample(request: SampleScene) -> Sampled:
        raise InvalidInput("no")

    with serving(address, {SampleScene: sample}, observer=notes), client_of(address) as client:
        with pytest.raises(Rejected):
            client.call(ask(1))
        wait_until(lambda: notes.requests)
    assert notes.told() == [("SampleScene", "failed", "invalid-input")]


def test_one_that_comes_while_the_worker_drains_is_refused(address, notes):
    begun, may_end = threading.Event(), threading.Event()

    def sample(request: SampleScene) -> Sampled:
        begun.set()
        may_end.wait(20)
        return scene_for(request.seed)

    options = {"role": Role.RENDER, "bind": address, "observer": notes}
    worker = threading.Thread(target=serve, args=(lambda: {SampleScene: sample},), kwargs=options, daemon=True)
    worker.start()
    with bare_client(address) as client:
        client.ask(ask(1), 1)
        assert begun.wait(20)
        client.ask(Drain(), 2)
        client.ask(ask(3), 3)
        header, reply = client.receive()
        assert header.request == 3
        assert isinstance(reply, Failure)
        wait_until(lambda: notes.requests)
        may_end.set()
        worker.join(20)
    assert notes.told() == [("SampleScene", "refused", "draining"), ("SampleScene", "answered", "")]
    assert (notes.requests[0].queue, notes.requests[0].compute) == (None, None)
