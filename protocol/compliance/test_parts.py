"""Parts of pictures: a worker draws what it was asked for, or all of the picture."""

from functools import partial
from typing import Any

import pytest
from msgspec.structs import replace

from protocol.compliance.wire import Wire, changed, parts_of
from protocol.compliance.work import Work
from protocol.frame import Frame
from protocol.messages import Failure, Render

_OUTSIDE = {
    "empty": {"left": 3, "top": 3, "width": 0, "height": 2},
    "before the picture": {"left": -1, "top": 0, "width": 8, "height": 8},
    "beyond the picture": {"left": 30, "top": 0, "width": 3, "height": 8},
}


@pytest.fixture
def parts(work: Work) -> tuple[Render, ...]:
    """Parts to ask for."""
    return work.parts() or pytest.skip("the role draws no pictures")


def test_a_part_of_a_picture_is_what_the_whole_picture_shows_there(wire: Wire, parts: tuple[Render, ...]) -> None:
    """A `Render` with a region is answered by that part and the same region, or by all of the picture and none.

    Either way every byte is the one that the whole picture has there, the noise of depth included.
    """
    for request in parts:
        whole, part = wire.call(replace(request, region=None)), wire.call(request)
        assert isinstance(whole, Frame), whole
        assert isinstance(part, Frame), part
        assert part.region in (None, request.region), "it is another part than was asked for"
        cut = whole.part(part.area)
        assert part.rgb.tobytes() == cut.rgb.tobytes(), f"{part.area} has other colours in the whole picture"
        assert part.depth.tobytes() == cut.depth.tobytes(), f"{part.area} has another depth in the whole picture"


@pytest.mark.parametrize("region", _OUTSIDE.values(), ids=_OUTSIDE)
def test_a_region_that_is_not_in_the_picture_is_refused_or_passed_over(
    wire: Wire, parts: tuple[Render, ...], region: dict[str, int]
) -> None:
    """A region that is empty or exceeds the picture is refused; a worker without regions draws the whole picture."""
    number = wire.next_number()
    prelude, header, body = parts_of(parts[0], number)
    wire.send([prelude, header, changed(body, partial(_put, "region", region))])
    reply = wire.answer(number).message
    if isinstance(reply, Failure):
        assert reply.code in ("invalid-input", "malformed-message"), reply
    else:
        assert isinstance(reply, Frame), reply
        assert reply.region is None, "a part that is not there came"


def _put(name: str, value: Any, fields: dict[str, Any]) -> None:
    fields[name] = value
