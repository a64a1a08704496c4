"""What a camera saw: colours, distances and where it stood."""

from typing import Literal, TypeAlias, get_args

from protocol.arrays import BoolArray, Float32Array, Float64Array, UInt8Array, require_shape
from protocol.camera import Camera
from protocol.message import Reply, Value
from protocol.skeleton import JOINT_COUNT

PackedEncoding: TypeAlias = Literal["lossless", "jpeg"]
Encoding: TypeAlias = Literal["none", PackedEncoding]
"""How a frame travels: as it is, smaller and the same to the bit, or with colours that are a little off."""

ENCODINGS: tuple[Encoding, ...] = get_args(Encoding)


class Packed(Value, frozen=True, eq=False, kw_only=True):
    """A picture made smaller for its way; `protocol.packing` makes it and opens it.

    Attributes:
        rgb, depth: (n,) bytes. The size of the picture is its camera's.
    """

    encoding: PackedEncoding
    rgb: UInt8Array
    depth: UInt8Array

    def __post_init__(self) -> None:
        require_shape("rgb", self.rgb, (None,))
        require_shape("depth", self.depth, (None,))


class Frame(Reply, frozen=True, eq=False, kw_only=True):
    """An RGB-D picture and the camera that took it.

    Attributes:
        rgb: (height, width, 3); (0, 0, 3) where it is packed.
        depth: (height, width), metres along the view (not along the ray); 0 or not finite where nothing was measured;
            (0, 0) where it is packed.
        joints: (18, 3) true joints in the world frame, metres, where the truth was asked for and is known.
        visible: (18,) whether the camera sees that joint, with `joints`.
        timings: seconds by stage.
        packed: the picture, in place of `rgb` and `depth`.
    """

    rgb: UInt8Array
    depth: Float32Array
    camera: Camera
    joints: Float64Array | None = None
    visible: BoolArray | None = None
    timings: dict[str, float] = {}
    packed: Packed | None = None

    def __post_init__(self) -> None:
        size = (self.camera.intrinsics.height, self.camera.intrinsics.width) if self.packed is None else (0, 0)
        require_shape("rgb", self.rgb, (*size, 3))
        require_shape("depth", self.depth, size)
        if self.joints is not None:
            require_shape("joints", self.joints, (JOINT_COUNT, 3))
        if self.visible is not None:
            require_shape("visible", self.visible, (JOINT_COUNT,))

    @property
    def encoding(self) -> Encoding:
        """How it travels."""
        return "none" if self.packed is None else self.packed.encoding
