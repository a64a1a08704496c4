"""The table that a lifter is fitted on: a row for each view, with its evidence and its truth."""

from collections.abc import Mapping, Sequence

import pyarrow as pa

from orchestrator.experiments.list_columns import numbers, table_with
from orchestrator.lifter.views import FitView
from protocol.camera import Camera
from protocol.errors import InvalidInput
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.pose_estimate import PoseEstimate
from protocol.scene import Scene
from protocol.skeleton import JOINT_COUNT

SCHEMA = pa.schema(
    [
        pa.field("view", pa.int32()),
        pa.field("identity", pa.int16()),
        pa.field("poses", pa.string()),
        pa.field("depth_noise", pa.string()),
        pa.field("accompanied", pa.bool_()),
        pa.field("hidden", pa.bool_()),
        pa.field("known", pa.bool_()),
        pa.field("distance", pa.float32()),
        # fx, fy, cx and cy in pixels; position and target in the world, metres.
        pa.field("intrinsics", numbers(4)),
        pa.field("pose", numbers(6)),
        pa.field("keypoints", numbers(2 * JOINT_COUNT)),
        pa.field("height", numbers(JOINT_COUNT)),
        pa.field("narrow", numbers(EVIDENCE_SIZE * JOINT_COUNT)),
        pa.field("wide", numbers(EVIDENCE_SIZE * JOINT_COUNT)),
        pa.field("joints", numbers(3 * JOINT_COUNT)),
        pa.field("visible", pa.list_(pa.bool_(), JOINT_COUNT)),
    ]
)


def row_of(view: FitView, poses: str, scene: Scene, camera: Camera, observation: PoseEstimate) -> dict[str, object]:
    """A view's row.

    Raises:
        InvalidInput: the truth or the evidence is missing, since a worker is older than this command.
    """
    if observation.joints is None or observation.visible is None or observation.evidence is None:
        raise InvalidInput("an observation came without the truth or the evidence; are the workers of this version?")
    intrinsics = camera.intrinsics
    return {
        "view": view.number,
        "identity": scene.identity,
        "poses": poses,
        "depth_noise": camera.depth_noise,
        "accompanied": bool(scene.bystanders),
        "hidden": view.hidden,
        "known": view.off is not None,
        "distance": view.viewpoint.distance,
        "intrinsics": (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy),
        "pose": (*camera.pose.position, *camera.pose.target),
        "keypoints": observation.keypoints.ravel(),
        "height": observation.height,
        "narrow": observation.evidence.narrow.ravel(),
        "wide": observation.evidence.wide.ravel(),
        "joints": observation.joints.ravel(),
        "visible": observation.visible,
    }


def table_of(rows: Sequence[Mapping[str, object]]) -> pa.Table:
    """The rows as a table."""
    return table_with(SCHEMA, {name: [row[name] for row in rows] for name in SCHEMA.names})
