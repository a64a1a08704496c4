"""Frames from render workers: their encoding, and the seconds of their way."""

import logging
from collections.abc import Sequence

from msgspec.structs import replace

from perception_worker.stopwatch import Clock, Stopwatch
from protocol.client.pool import Pool
from protocol.config import FrameEncoding
from protocol.errors import MalformedMessage
from protocol.frame import Encoding, Frame
from protocol.messages import Observe, Render
from protocol.packing.packing import unpack
from protocol.region import Region
from protocol.security.policy import is_local

_logger = logging.getLogger(__name__)


class RenderedFrames:
    """Asks render workers for frames.

    Args:
        deadline: seconds that a frame may take, with retries on other workers included.
        encoding: of frames; `auto` chooses by the workers' addresses, for each request.
    """

    def __init__(self, renderers: Pool, *, deadline: float, encoding: FrameEncoding, clock: Clock) -> None:
        self._renderers = renderers
        self._deadline = deadline
        self._encoding: FrameEncoding = encoding
        self._clock = clock
        self._asked_last: Encoding | None = None

    def of(self, request: Observe) -> "RenderedPictures":
        """The picture of a request's camera."""
        return RenderedPictures(self, request, until=self._clock() + self._deadline)

    def fetch(self, render: Render, until: float) -> Frame:
        """Have a scene rendered; the frame's `timings` have the seconds of rendering and of its way here.

        Args:
            until: by the clock, when to give up.

        Raises:
            CallFailed: no render worker gave a frame; another try may succeed.
            MalformedMessage, LimitExceeded: the frame is not the requested one.
        """
        render = replace(render, encoding=self._choose())
        pending = self._renderers.submit(render, deadline=max(until - self._clock(), 0.0))
        frame = pending.result()
        # A worker that knows no packing or no regions sends the whole frame unpacked. No other departure is allowed.
        if frame.encoding not in ("none", render.encoding):
            raise MalformedMessage(f"a frame came as {frame.encoding}, {render.encoding} was asked for")
        if frame.region not in (None, render.region):
            raise MalformedMessage(f"a frame of {frame.region} came, {render.region} was asked for")
        way_here = {"render": pending.timing.compute, "transport": pending.timing.transport}
        opened = opened_by(self._clock, frame)
        return replace(opened, timings=way_here | opened.timings)

    def _choose(self) -> Encoding:
        encoding = chosen(self._encoding, self._renderers.addresses)
        if encoding != self._asked_last:
            _logger.info("frames are asked for as %s (perception.frames is %s)", encoding, self._encoding)
            self._asked_last = encoding
        return encoding


class RenderedPictures:
    """The picture of a request's camera, of which only the requested parts are rendered.

    Args:
        until: by the clock of `frames`, when to give up.
    """

    def __init__(self, frames: RenderedFrames, request: Observe, *, until: float) -> None:
        self.camera = request.camera
        self.area = Region.seen_by(request.camera.intrinsics)
        self.timings: dict[str, float] = {}
        self._frames = frames
        self._render = Render(scene=request.scene, camera=request.camera, truth=request.truth)
        self._until = until

    def part(self, region: Region) -> Frame:
        """Exactly that part; raises as `RenderedFrames.fetch`."""
        wanted = None if region == self.area else region
        frame = self._frames.fetch(replace(self._render, region=wanted), self._until)
        for stage, seconds in frame.timings.items():
            self.timings[stage] = self.timings.get(stage, 0.0) + seconds
        if frame.camera != self.camera:
            raise MalformedMessage("a frame of another camera came than was asked for")
        return frame.part(region)


def opened_by(clock: Clock, frame: Frame) -> Frame:
    """The frame with its arrays; if it was packed, its timings have the seconds of unpacking.

    Raises:
        MalformedMessage, LimitExceeded: it can't be opened.
    """
    if frame.packed is None:
        return frame
    stopwatch = Stopwatch(clock)
    with stopwatch.stage("unpack"):
        opened = unpack(frame)
    return replace(opened, timings=frame.timings | stopwatch.seconds)


def chosen(encoding: FrameEncoding, addresses: Sequence[str]) -> Encoding:
    """The encoding of frames from these workers.

    `auto` never changes a frame. Within a machine, copying 2 MB takes less time than compressing them.
    """
    if encoding != "auto":
        return encoding
    return "none" if all(map(is_local, addresses)) else "lossless"
