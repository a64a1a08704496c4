"""Limits on messages and queues, so that no peer can make this process run out of memory."""

from msgspec import Struct

from protocol.errors import InvalidConfig, LimitExceeded

KIB = 1024
MIB = 1024 * KIB


class Limits(Struct, frozen=True, kw_only=True):
    """The largest sizes, checked before memory is allocated.

    Attributes:
        header_bytes, body_bytes, array_bytes: of one part of a message.
        message_bytes: of all parts of a message together.
        arrays: number of arrays that a message may carry.
        queue: number of requests that a worker takes at once; it refuses further ones as `overloaded`, retryable.
        under_way: number of requests that `map` keeps under way to each worker.

    Raises:
        InvalidConfig: a limit is below 1.
    """

    header_bytes: int = 4 * KIB
    body_bytes: int = MIB
    array_bytes: int = 64 * MIB
    message_bytes: int = 160 * MIB
    arrays: int = 32
    queue: int = 64
    under_way: int = 8

    def __post_init__(self) -> None:
        for name in self.__struct_fields__:
            if getattr(self, name) < 1:
                raise InvalidConfig(f"limits.{name} is {getattr(self, name)}; it must be at least 1")

    @property
    def part_bytes(self) -> int:
        """The largest part of any kind; the sockets refuse a larger one."""
        return max(self.header_bytes, self.body_bytes, self.array_bytes)

    @property
    def parts(self) -> int:
        """The largest number of parts of a message: prelude, header, body and arrays."""
        return 3 + self.arrays


DEFAULT_LIMITS = Limits()


def require_picture_travels(width: int, height: int, limits: Limits = DEFAULT_LIMITS) -> None:
    """Raise `LimitExceeded` unless a frame of this size may be sent; a packed frame is limited by its unpacked size."""
    pixels = width * height
    colours, depth = 3 * pixels, 4 * pixels
    if max(colours, depth) > limits.array_bytes or colours + depth > limits.message_bytes:
        raise LimitExceeded(
            f"a picture of {width}×{height} pixels takes arrays of {colours} and {depth} bytes; "
            f"{limits.array_bytes} are allowed each, {limits.message_bytes} together"
        )
