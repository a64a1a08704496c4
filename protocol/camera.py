"""The pinhole camera and its geometry.

Frames of reference: *world* has z up; *camera* has x to the right of the image, y down and z along the view (OpenCV's).
A pixel's centre has integer coordinates, so an image of width w spans from -0.5 to w - 0.5. All lengths are metres.
"""

import math
from typing import Annotated, Literal, TypeAlias

import numpy as np
from msgspec import Meta, Struct

from protocol.arrays import Float64Array
from protocol.quantities import Coordinate, FocalLength, PixelCoordinate

Vector3: TypeAlias = tuple[float, float, float]
Place: TypeAlias = tuple[Coordinate, Coordinate, Coordinate]
"""Metres in the world frame."""

PictureSide: TypeAlias = Annotated[int, Meta(ge=1, le=8192)]
DepthNoise: TypeAlias = Literal["none", "d435i"]


class Intrinsics(Struct, frozen=True):
    """Image size and pinhole parameters, in pixels."""

    width: PictureSide
    height: PictureSide
    fx: FocalLength
    fy: FocalLength
    cx: PixelCoordinate
    cy: PixelCoordinate

    def __post_init__(self) -> None:
        if not (0 < self.width <= 8192 and 0 < self.height <= 8192):
            raise ValueError(f"an image of {self.width}×{self.height} pixels can't be made (1 to 8192 each way)")
        if not (0 < self.fx < math.inf and 0 < self.fy < math.inf):
            raise ValueError("focal lengths must be positive and finite")
        if not (math.isfinite(self.cx) and math.isfinite(self.cy)):
            raise ValueError("a principal point must be finite")

    @classmethod
    def from_horizontal_fov(cls, width: int, height: int, degrees: float) -> "Intrinsics":
        """Square pixels, the principal point in the middle of the image."""
        focal = width / 2 / math.tan(math.radians(degrees) / 2)
        return cls(width, height, focal, focal, (width - 1) / 2, (height - 1) / 2)


class CameraPose(Struct, frozen=True):
    """Where a camera is and the point that it looks at, in the world frame (z up, metres)."""

    position: Place
    target: Place

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in (*self.position, *self.target)):
            raise ValueError("a camera's position and target must be finite")
        sideways = math.hypot(self.target[0] - self.position[0], self.target[1] - self.position[1])
        if sideways < 1e-6:
            raise ValueError("a camera can't look straight up or down, nor at its own position")


class Camera(Struct, frozen=True):
    """Everything that a picture depends on, apart from the scene."""

    pose: CameraPose
    intrinsics: Intrinsics
    depth_noise: DepthNoise = "none"


def world_to_camera(pose: CameraPose) -> Float64Array:
    """The (4, 4) transform from world to camera coordinates; the camera does not roll."""
    eye, target = np.asarray(pose.position, float), np.asarray(pose.target, float)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = _cross(forward, np.array([0.0, 0.0, 1.0]))
    right /= np.linalg.norm(right)
    transform = np.eye(4)
    transform[:3, :3] = right, _cross(forward, right), forward
    transform[:3, 3] = -transform[:3, :3] @ eye
    return transform


def _cross(a: Float64Array, b: Float64Array) -> Float64Array:
    """The cross product of two vectors (3,), bit for bit as `np.cross`, without its checks."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def project(points: Float64Array, camera: Camera) -> Float64Array:
    """World points (n, 3) to pixel x, pixel y and planar depth in metres, negative behind the camera: (n, 3)."""
    transform = world_to_camera(camera.pose)
    x, y, depth = (points @ transform[:3, :3].T + transform[:3, 3]).T
    intrinsics = camera.intrinsics
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.stack(
            [intrinsics.fx * x / depth + intrinsics.cx, intrinsics.fy * y / depth + intrinsics.cy, depth], axis=1
        )


def back_project(pixels: Float64Array, depth: Float64Array, camera: Camera) -> Float64Array:
    """Pixels (n, 2) at planar depths (n,), in metres, to world points (n, 3). NaN in, NaN out."""
    intrinsics = camera.intrinsics
    x = depth * (pixels[:, 0] - intrinsics.cx) / intrinsics.fx
    y = depth * (pixels[:, 1] - intrinsics.cy) / intrinsics.fy
    transform = world_to_camera(camera.pose)
    return (np.stack([x, y, depth], axis=1) - transform[:3, 3]) @ transform[:3, :3]
