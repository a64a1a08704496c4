"""Frames from render workers: how they are to come, and what their way took."""

import logging
from collections.abc import Sequence

from msgspec.structs import replace

from perception_worker.stopwatch import Clock, Stopwatch
from protocol.config import FrameEncoding
from protocol.errors import MalformedMessage
from protocol.frame import Encoding, Frame
from protocol.messages import Observe, Render
from protocol.packing import unpack
from protocol.pool import Pool
from protocol.security.policy import is_local

_logger = logging.getLogger(__name__)


class RenderedFrames:
    """Asks render workers for frames.

    Args:
        deadline: seconds that a frame may take, lost workers and all.
        encoding: how frames are to come; `auto` looks at where the workers are, each time.
    """

    def __init__(self, renderers: Pool, *, deadline: float, encoding: FrameEncoding, clock: Clock) -> None:
        self._renderers = renderers
        self._deadline = deadline
        self._encoding: FrameEncoding = encoding
        self._clock = clock
        self._asked_last: Encoding | None = None

    def fetch(self, request: Observe) -> Frame:
        """Have a scene rendered; the frame's `timings` have what that took, and its way here.

        Raises:
            CallFailed: no render worker gave a frame; another try may.
            MalformedMessage, LimitExceeded: what came is no frame as it was asked for.
        """
        encoding = self._choose()
        render = Render(scene=request.scene, camera=request.camera, truth=request.truth, encoding=encoding)
        pending = self._renderers.submit(render, deadline=self._deadline)
        frame = pending.result()
        # A worker that knows nothing of packing answers as ever. No other departs from what was asked for.
        if frame.encoding not in ("none", encoding):
            raise MalformedMessage(f"a frame came as {frame.encoding}, {encoding} was asked for")
        way_here = {"render": pending.timing.compute, "transport": pending.timing.transport}
        opened = opened_by(self._clock, frame)
        return replace(opened, timings=way_here | opened.timings)

    def _choose(self) -> Encoding:
        encoding = chosen(self._encoding, self._renderers.addresses)
        if encoding != self._asked_last:
            _logger.info("frames are asked for as %s (perception.frames is %s)", encoding, self._encoding)
            self._asked_last = encoding
        return encoding


def opened_by(clock: Clock, frame: Frame) -> Frame:
    """The frame with its arrays; what it took to open it is in its timings, if it was packed.

    Raises:
        MalformedMessage, LimitExceeded: it can't be opened.
    """
    if frame.packed is None:
        return frame
    watch = Stopwatch(clock)
    with watch.stage("unpack"):
        opened = unpack(frame)
    return replace(opened, timings=frame.timings | watch.seconds)


def chosen(encoding: FrameEncoding, addresses: Sequence[str]) -> Encoding:
    """How frames are to come from these workers.

    Left to us, never so that a frame is changed. Within a machine 2 MB are copied sooner than made smaller.
    """
    if encoding != "auto":
        return encoding
    return "none" if all(map(is_local, addresses)) else "lossless"
