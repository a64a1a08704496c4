"""Messages of newer and of older versions of the protocol, with more or fewer fields, are understood."""

from collections.abc import Callable
from typing import Any, cast

import pytest

from protocol.compliance.wire import Wire, changed, parts_of
from protocol.compliance.work import Work
from protocol.messages import Ping, Pong

_LATER = {"added_later": [1, {"a": None}, "é", b"\0\xff", 2.5]}


def _add_everywhere(fields: dict[str, Any]) -> None:
    """A field to the message and to every struct within it, but not to arrays and to maps of seconds by stage."""
    for name, value in fields.items():
        if isinstance(value, dict) and name != "timings" and "dtype" not in value:
            _add_everywhere(cast("dict[str, Any]", value))
    fields |= _LATER


def _leave_out_defaults(fields: dict[str, Any]) -> None:
    for name in ("truth", "heatmaps", "encoding", "region"):
        fields.pop(name, None)
    fields.get("camera", fields.get("frame", {}).get("camera", {})).pop("depth_noise", None)


@pytest.mark.parametrize("change", [_add_everywhere, _leave_out_defaults], ids=["fields of later", "fields of before"])
def test_work_of_an_older_or_newer_client_is_done(
    wire: Wire, work: Work, change: Callable[[dict[str, Any]], None]
) -> None:
    """Fields that the worker does not know are passed over; those with a default that are missing take it.

    So a worker may be updated before its clients, and after them.
    """
    request, number = work.small(), wire.next_number()
    prelude, header, body, *arrays = parts_of(request, number)
    wire.send([prelude, header, changed(body, change), *arrays])
    reply = wire.answer(number).message
    assert work.answers(reply, request), reply


def test_a_header_of_a_newer_client_is_read(wire: Wire, work: Work) -> None:
    """Unknown fields of a header are ignored as well."""
    request, number = work.small(), wire.next_number()
    prelude, header, *rest = parts_of(request, number)
    wire.send([prelude, changed(header, lambda fields: fields.update(_LATER)), *rest])
    assert work.answers(wire.answer(number).message, request)


def test_a_ping_of_a_newer_client_is_answered(wire: Wire) -> None:
    """Ping has no fields today; a body that has some is a ping all the same."""
    number = wire.next_number()
    prelude, header, body = parts_of(Ping(), number)
    wire.send([prelude, header, changed(body, lambda fields: fields.update(_LATER))])
    assert isinstance(wire.answer(number).message, Pong)
