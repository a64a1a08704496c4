"""An RGB-D picture and the camera that took it."""

from typing import Annotated, Literal, TypeAlias, get_args

from msgspec.structs import replace

from protocol.arrays import Elements, Float32Array, UInt8Array, require_shape
from protocol.camera import Camera
from protocol.errors import InvalidInput
from protocol.joint_arrays import JointFlags, JointTruth
from protocol.message import Reply, Value
from protocol.quantities import Measured
from protocol.region import Region, require_in_picture

PackedEncoding: TypeAlias = Literal["lossless", "jpeg"]
Encoding: TypeAlias = Literal["none", PackedEncoding]
"""How a frame is sent: not packed, packed without loss, or with its colours as JPEG."""

PackedBytes: TypeAlias = Annotated[UInt8Array, Elements((None,))]

ENCODINGS: tuple[Encoding, ...] = get_args(Encoding)


class Packed(Value, frozen=True, eq=False, kw_only=True):
    """A packed picture; `protocol.packing.packing` packs and unpacks it.

    Attributes:
        rgb, depth: (n,) bytes. The size of the picture is that of the frame's area.
    """

    encoding: PackedEncoding
    rgb: PackedBytes
    depth: PackedBytes


class Frame(Reply, frozen=True, eq=False, kw_only=True):
    """An RGB-D picture, or a part of one, and the camera that took it.

    All pixel coordinates of a frame are those of the whole picture.

    Attributes:
        rgb: (height, width, 3); (0, 0, 3) in a packed frame.
        depth: (height, width), metres along the view (not along the ray); 0 or not finite where nothing was measured;
            (0, 0) in a packed frame.
        joints: (18, 3) true joints in the world frame, metres; None if the truth was not requested or is not known.
        visible: (18,) whether the camera sees that joint; None like `joints`.
        timings: seconds by stage.
        packed: the packed picture, in place of `rgb` and `depth`.
        region: the part of the camera's picture that this is, with the size of `rgb` and `depth`; None for all of it.
    """

    rgb: Annotated[UInt8Array, Elements((None, None, 3))]
    depth: Annotated[Float32Array, Elements((None, None), or_anything=True)]
    camera: Camera
    joints: JointTruth | None = None
    visible: JointFlags | None = None
    timings: dict[str, Measured] = {}
    packed: Packed | None = None
    region: Region | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.region is not None:
            require_in_picture(self.region, self.camera.intrinsics)
        size = self.area.shape if self.packed is None else (0, 0)
        require_shape("rgb", self.rgb, (*size, 3))
        require_shape("depth", self.depth, size)

    @property
    def area(self) -> Region:
        """The part of the camera's picture that it shows."""
        return self.region or Region.seen_by(self.camera.intrinsics)

    def part(self, region: Region) -> "Frame":
        """The part of the frame in a region; the arrays are not copied.

        Raises:
            InvalidInput: the frame does not show all of the region, or is packed.
        """
        if region == self.area:
            return self
        if self.packed is not None or not region.is_within(self.area):
            raise InvalidInput(f"{region} can't be cut out of a frame of {self.area} that came as {self.encoding}")
        inner = region.within(self.area)
        return replace(self, rgb=inner.part(self.rgb), depth=inner.part(self.depth), region=region)

    @property
    def encoding(self) -> Encoding:
        """How the frame is sent."""
        return "none" if self.packed is None else self.packed.encoding
