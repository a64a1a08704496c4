"""What a camera saw: colours, distances and where it stood."""

from protocol.arrays import BoolArray, Float32Array, Float64Array, UInt8Array, require_shape
from protocol.camera import Camera
from protocol.message import Reply
from protocol.skeleton import JOINT_COUNT


class Frame(Reply, frozen=True, eq=False, kw_only=True):
    """An RGB-D picture and the camera that took it.

    Attributes:
        rgb: (height, width, 3).
        depth: (height, width), metres along the view (not along the ray); 0 or not finite where nothing was measured.
        joints: (18, 3) true joints in the world frame, metres, where the truth was asked for and is known.
        visible: (18,) whether the camera sees that joint, with `joints`.
        timings: seconds by stage.
    """

    rgb: UInt8Array
    depth: Float32Array
    camera: Camera
    joints: Float64Array | None = None
    visible: BoolArray | None = None
    timings: dict[str, float] = {}

    def __post_init__(self) -> None:
        size = (self.camera.intrinsics.height, self.camera.intrinsics.width)
        require_shape("rgb", self.rgb, (*size, 3))
        require_shape("depth", self.depth, size)
        if self.joints is not None:
            require_shape("joints", self.joints, (JOINT_COUNT, 3))
        if self.visible is not None:
            require_shape("visible", self.visible, (JOINT_COUNT,))
