"""Requests that a worker does not answer are refused as `unsupported`."""

import pytest

from protocol.catalogue import Message
from protocol.compliance.wire import Wire, parts_of
from protocol.compliance.work import SCENE, frame_to_perceive
from protocol.messages import (
    Drained,
    Failure,
    Lookup,
    Pong,
    Register,
    Render,
    Role,
    Sampled,
    State,
    Welcome,
    WorkerRecord,
)

_RECORD = WorkerRecord(role=Role.RENDER, address="tcp://127.0.0.1:1", incarnation="x", state=State.READY)
_REPLIES = (
    Welcome(version=1, role=Role.RENDER, incarnation="x", heartbeat=1.0),
    Pong(incarnation="x", state=State.READY, progress=0, queue_depth=0, resident_bytes=0),
    Drained(),
    Sampled(scene=SCENE),
    Failure(code="x", message="x"),
)


@pytest.mark.parametrize("request_", [Lookup(role=Role.RENDER), Register(worker=_RECORD)], ids=["Lookup", "Register"])
def test_a_request_of_another_role_is_unsupported(wire: Wire, request_: Message) -> None:
    """A request that the worker's role does not answer is answered by `unsupported`, not retryable.

    It is a mistake in the client's addresses, and no further try will help.
    """
    number = wire.next_number()
    wire.send(parts_of(request_, number))
    _require_unsupported(wire.answer(number).message)


def test_the_other_worker_s_work_is_unsupported(wire: Wire, welcome: Welcome) -> None:
    """A render worker perceives nothing, and a perception worker draws nothing."""
    if welcome.role is Role.RENDER:
        _require_unsupported(wire.call(frame_to_perceive()))
    else:
        camera = frame_to_perceive().frame.camera
        _require_unsupported(wire.call(Render(scene=SCENE, camera=camera)))


@pytest.mark.parametrize("reply", _REPLIES, ids=lambda reply: type(reply).__name__)
def test_a_reply_is_no_request(wire: Wire, reply: Message) -> None:
    """A message that is no request is answered by unsupported; above all, not taken for an answer to anything."""
    number = wire.next_number()
    wire.send(parts_of(reply, number))
    _require_unsupported(wire.answer(number).message)


def _require_unsupported(failure: Message) -> None:
    assert isinstance(failure, Failure), failure
    assert (failure.code, failure.retryable) == ("unsupported", False)
