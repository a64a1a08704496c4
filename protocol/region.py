"""A part of a picture: a rectangle of whole pixels, and conversions between its own and the whole picture's pixels."""

from typing import Annotated, TypeVar

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from protocol.arrays import Float64Array
from protocol.camera import Intrinsics

ElementT = TypeVar("ElementT", bound=np.generic)


class Region(Struct, frozen=True):
    """A rectangle of whole pixels, counted from the whole picture's upper left corner."""

    left: Annotated[int, Meta(ge=0)]
    top: Annotated[int, Meta(ge=0)]
    width: Annotated[int, Meta(ge=1)]
    height: Annotated[int, Meta(ge=1)]

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(f"a region of {self.width}×{self.height} pixels is empty")
        if self.left < 0 or self.top < 0:
            raise ValueError(f"a region can't begin at ({self.left}, {self.top}), outside of the picture")

    @classmethod
    def whole(cls, height: int, width: int) -> "Region":
        """All of a picture."""
        return cls(0, 0, width, height)

    @classmethod
    def seen_by(cls, intrinsics: Intrinsics) -> "Region":
        """All of a camera's picture."""
        return cls(0, 0, intrinsics.width, intrinsics.height)

    @property
    def right(self) -> int:
        """The first column to the right of it."""
        return self.left + self.width

    @property
    def bottom(self) -> int:
        """The first row below it."""
        return self.top + self.height

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.height, self.width

    def is_within(self, other: "Region") -> bool:
        """Whether it lies in another region."""
        return (
            self.left >= other.left
            and self.top >= other.top
            and self.right <= other.right
            and self.bottom <= other.bottom
        )

    def part(self, picture: NDArray[ElementT]) -> NDArray[ElementT]:
        """The region of a whole picture (rows, columns, …), as a view."""
        return picture[self.top : self.bottom, self.left : self.right]

    def within(self, other: "Region") -> "Region":
        """The same rectangle, counted from another region's corner."""
        return Region(self.left - other.left, self.top - other.top, self.width, self.height)

    def inside(self, pixels: Float64Array) -> Float64Array:
        """Pixels x, y of the whole picture (n, 2) as pixels of the region."""
        return pixels - (self.left, self.top)

    def pixels(self, cells: Float64Array, map_size: tuple[int, int]) -> Float64Array:
        """Columns and rows of a map of the region (n, 2), centres at integers, as pixels of the whole picture."""
        rows, columns = map_size
        scale = np.array([self.width / columns, self.height / rows])
        return (cells + 0.5) * scale - 0.5 + (self.left, self.top)


def require_in_picture(region: Region, intrinsics: Intrinsics) -> None:
    """Raise `ValueError` unless a region lies in the camera's picture; see `protocol.arrays.require_shape`."""
    if not region.is_within(Region.seen_by(intrinsics)):
        raise ValueError(
            f"the region of columns {region.left} to {region.right} and rows {region.top} to {region.bottom} is not in "
            f"a picture of {intrinsics.width}×{intrinsics.height} pixels"
        )
