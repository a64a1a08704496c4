"""Where pictures and parts of them come from: a frame at hand, or a renderer."""

from typing import Protocol

from protocol.camera import Camera
from protocol.frame import Frame
from protocol.region import Region


class Pictures(Protocol):
    """A camera's picture of one moment, of which any part may be asked for."""

    @property
    def camera(self) -> Camera:
        """The camera."""
        ...

    @property
    def area(self) -> Region:
        """The largest part that may be asked for."""
        ...

    @property
    def timings(self) -> dict[str, float]:
        """Seconds by stage that getting pictures has taken so far."""
        ...

    def part(self, region: Region) -> Frame:
        """Exactly that part.

        Raises:
            InvalidInput: it is not in the area.
            CallFailed: it did not come; another try may succeed.
        """
        ...


class HeldPictures:
    """The parts of a frame at hand."""

    def __init__(self, frame: Frame) -> None:
        self.camera = frame.camera
        self.area = frame.area
        self.timings: dict[str, float] = {}
        self._frame = frame

    def part(self, region: Region) -> Frame:
        """Exactly that part.

        Raises:
            InvalidInput: it is not in the area.
        """
        return self._frame.part(region)
