"""How much of anything is taken, so that no peer can make this process run out of memory."""

from msgspec import Struct

from protocol.errors import InvalidConfig, LimitExceeded

KIB = 1024
MIB = 1024 * KIB


class Limits(Struct, frozen=True, kw_only=True):
    """Largest sizes, checked before anything is allocated for what was announced.

    Attributes:
        header_bytes, body_bytes, array_bytes: of one part of a message.
        message_bytes: of all its parts together.
        arrays: how many arrays a message may carry.
        queue: requests that a worker takes at once; the next one is answered with a retryable `overloaded`.
        under_way: requests that `map` keeps under way to each worker.
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
        """The largest part of any kind: what the sockets themselves refuse to go beyond."""
        return max(self.header_bytes, self.body_bytes, self.array_bytes)

    @property
    def parts(self) -> int:
        """The most parts that a message may have: prelude, header, body and arrays."""
        return 3 + self.arrays


DEFAULT_LIMITS = Limits()


def require_picture_travels(width: int, height: int, limits: Limits = DEFAULT_LIMITS) -> None:
    """Raise `LimitExceeded` unless a frame of so many pixels may travel; packed, it must open to no more."""
    pixels = width * height
    colours, depth = 3 * pixels, 4 * pixels
    if max(colours, depth) > limits.array_bytes or colours + depth > limits.message_bytes:
        raise LimitExceeded(
            f"a picture of {width}×{height} pixels takes arrays of {colours} and {depth} bytes; "
            f"{limits.array_bytes} are allowed each, {limits.message_bytes} together"
        )
