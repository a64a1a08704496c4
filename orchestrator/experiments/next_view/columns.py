"""The table of the experiment: a row for each camera of each scene's array."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
import pyarrow as pa

from orchestrator.experiments.list_columns import numbers, table_with
from orchestrator.experiments.next_view.views import CELLS, CENTRE
from orchestrator.experiments.views import SeededScene
from protocol.arrays import AnyArray, UInt8Array
from protocol.camera import Camera
from protocol.errors import InvalidInput
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import JOINT_COUNT

PICTURE_SIZE = (320, 240)
"""Width and height of the centre's picture in the table."""

_JPEG_QUALITY = 92

SCHEMA = pa.schema(
    [
        # Of the scene, by its number in its split.
        pa.field("split", pa.string()),
        pa.field("scene", pa.int32()),
        pa.field("seed", pa.int64()),
        pa.field("identity", pa.int16()),
        pa.field("pose", pa.int16()),
        pa.field("yaw", pa.float64()),
        pa.field("person", numbers(2)),
        # Of the camera: its place in the array, and in the world.
        pa.field("column", pa.int8()),
        pa.field("row", pa.int8()),
        # fx, fy, cx and cy in pixels; position and target in the world, metres.
        pa.field("intrinsics", numbers(4)),
        pa.field("camera", numbers(6)),
        # Of the pose estimate; see `PoseEstimate`.
        pa.field("keypoints", numbers(2 * JOINT_COUNT)),
        pa.field("points", numbers(3 * JOINT_COUNT)),
        *(pa.field(name, numbers(JOINT_COUNT)) for name in ("mass", "height", "distance", "quality")),
        pa.field("expected_error", numbers(JOINT_COUNT)),
        pa.field("narrow", numbers(EVIDENCE_SIZE * JOINT_COUNT)),
        pa.field("wide", numbers(EVIDENCE_SIZE * JOINT_COUNT)),
        # The truth, world frame, metres.
        pa.field("joints", numbers(3 * JOINT_COUNT)),
        # Of the centre alone, as JPEG.
        pa.field("picture", pa.binary()),
    ]
)


def array_rows(
    number: int,
    split: str,
    scene: SeededScene,
    cameras: Sequence[Camera],
    estimates: Sequence[PoseEstimate],
    picture: UInt8Array,
) -> list[dict[str, object]]:
    """The rows of one scene.

    Args:
        number: of the scene in its split.
        cameras, estimates: of `CELLS`, in their order.
        picture: (height, width, 3) RGB of the centre.

    Raises:
        InvalidInput: the truth or the evidence is missing, since a worker is older than this command.
    """
    own = {
        "split": split,
        "scene": number,
        "seed": scene.seed,
        "identity": scene.scene.identity,
        "pose": scene.scene.pose.kind,
        "yaw": scene.scene.yaw,
        "person": scene.scene.position,
    }
    seen = zip(CELLS, cameras, estimates, strict=True)
    rows = [own | _view(column, row, camera, estimate) for (column, row), camera, estimate in seen]
    rows[CENTRE]["picture"] = jpeg(picture)
    return rows


def table_of(rows: Sequence[Mapping[str, object]]) -> pa.Table:
    """The rows as a table."""
    return table_with(SCHEMA, {name: [row[name] for row in rows] for name in SCHEMA.names})


def jpeg(picture: UInt8Array) -> bytes:
    """A picture at the table's size."""
    small = cv2.resize(picture, PICTURE_SIZE, interpolation=cv2.INTER_AREA)
    _, encoded = cv2.imencode(".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR), (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY))
    return encoded.tobytes()


def _view(column: int, row: int, camera: Camera, estimate: PoseEstimate) -> dict[str, object]:
    if estimate.joints is None or estimate.evidence is None:
        raise InvalidInput("an observation came without the truth or the evidence; are the workers of this version?")
    intrinsics = camera.intrinsics
    return {
        "column": column,
        "row": row,
        "intrinsics": (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy),
        "camera": (*camera.pose.position, *camera.pose.target),
        "keypoints": estimate.keypoints,
        "points": estimate.points,
        "mass": estimate.mass,
        "height": estimate.height,
        "distance": estimate.distance,
        "quality": estimate.quality,
        "expected_error": _or_nan(estimate.expected_error),
        "narrow": estimate.evidence.narrow,
        "wide": estimate.evidence.wide,
        "joints": estimate.joints,
        "picture": None,
    }


def _or_nan(values: AnyArray | None) -> AnyArray:
    return np.full(JOINT_COUNT, np.nan) if values is None else values
