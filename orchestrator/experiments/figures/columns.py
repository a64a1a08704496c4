"""The table of an experiment: its columns, and the rows of one observation.

One row for each joint of each frame. Lengths are metres in the world frame (z up), NaN where there is none; qualities
are in [0, 1], 1 is best, 0 where a joint was not detected.
"""

from collections.abc import Mapping

import numpy as np
import pyarrow as pa

from protocol.arrays import AnyArray, Float64Array
from protocol.camera import project
from protocol.errors import InvalidInput
from protocol.messages import Observe
from protocol.pose_estimate import Lifting, PoseEstimate
from protocol.skeleton import JOINT_COUNT

LIFTINGS: tuple[Lifting, ...] = ("mean", "median", "nearest")
"""The ways of lifting whose readings are kept beside the configured one's."""

_NAME = pa.dictionary(pa.int8(), pa.string())

_VIEW = {
    "frame": (pa.int32(), "number of the view, from 0"),
    "seed": (pa.int64(), "that the scene was drawn from"),
    "identity": (pa.int8(), "who is seen, 0 to 59"),
    "pose": (pa.int8(), "kind of body pose, 0 to 7; 0 in a family"),
    "poses": (_NAME, "kinds, or the family of poses"),
    "distance": (pa.float32(), "m along the ground from the person to the camera"),
    "azimuth": (pa.float32(), "degrees from the person's front to the camera, counter-clockwise seen from above"),
    "altitude": (pa.float32(), "m, of the camera above the ground"),
    "depth_noise": (_NAME, "none, or d435i"),
    "camera_x": (pa.float32(), "m, position of the camera"),
    "camera_y": (pa.float32(), "m"),
    "camera_z": (pa.float32(), "m"),
    "target_x": (pa.float32(), "m, the point that the camera looks at"),
    "target_y": (pa.float32(), "m"),
    "target_z": (pa.float32(), "m"),
    "network": (_NAME, "the pose network"),
    "lifting": (_NAME, "the configured way of lifting"),
}
_JOINT = {
    "joint": (pa.int8(), "COCO-18 in OpenPose's order, 0 to 17"),
    "true_x": (pa.float32(), "m, the true joint"),
    "true_y": (pa.float32(), "m"),
    "true_z": (pa.float32(), "m"),
    "true_keypoint_x": (pa.float32(), "pixels, the true joint in the picture"),
    "true_keypoint_y": (pa.float32(), "pixels"),
    "visible": (pa.bool_(), "whether the camera sees the joint"),
    "detected": (pa.bool_(), "whether the network found it in the picture"),
    "located": (pa.bool_(), "whether it was placed in space by the configured lifting"),
    "keypoint_x": (pa.float32(), "pixels, where it was found"),
    "keypoint_y": (pa.float32(), "pixels"),
    "x": (pa.float32(), "m, the estimate by the configured lifting"),
    "y": (pa.float32(), "m"),
    "z": (pa.float32(), "m"),
    "error": (pa.float32(), "m between the estimate and the true joint"),
    "mass": (pa.float32(), "quality by the heatmap's mass"),
    "height": (pa.float32(), "quality by the heatmap's height"),
    "distance_quality": (pa.float32(), "quality by the distances between joints"),
    "quality": (pa.float32(), "the mean of the three"),
    "spread": (pa.float32(), "m between the nearest and the farthest depth in the window around the keypoint"),
    "expected_error": (pa.float32(), "m, expected by the worker; NaN where it is neither calibrated nor learned"),
    "radius": (pa.float32(), "m, of the sphere that holds the joint with probability 0.9; NaN likewise"),
}


def _reading(lifting: Lifting) -> dict[str, tuple[pa.DataType, str]]:
    return {
        f"x_{lifting}": (pa.float32(), f"m, the estimate by the {lifting} lifting"),
        f"y_{lifting}": (pa.float32(), "m"),
        f"z_{lifting}": (pa.float32(), "m"),
        f"error_{lifting}": (pa.float32(), "m between that estimate and the true joint"),
        f"distance_quality_{lifting}": (pa.float32(), "quality by distances between these estimates"),
        f"quality_{lifting}": (pa.float32(), "the mean of mass, height and that"),
    }


def _schema() -> pa.Schema:
    columns = _VIEW | _JOINT
    for lifting in LIFTINGS:
        columns |= _reading(lifting)
    return pa.schema([pa.field(name, kind, metadata={"description": words}) for name, (kind, words) in columns.items()])


SCHEMA = _schema()


def joint_columns(request: Observe, observation: PoseEstimate) -> dict[str, AnyArray]:
    """The columns of `_JOINT` and of each reading, 18 values each.

    Raises:
        InvalidInput: the truth or a reading did not come: the worker is older than this command.
    """
    if observation.joints is None or observation.visible is None:
        raise InvalidInput("an observation came without the truth; is the render worker of this version?")
    if lacking := [one for one in LIFTINGS if one not in observation.readings]:
        raise InvalidInput(f"an observation came without the readings {lacking}; is the worker of this version?")
    truth = observation.joints
    columns: dict[str, AnyArray] = {
        "joint": np.arange(JOINT_COUNT),
        **_axes("true_", truth),
        **_pixels("true_keypoint_", project(truth, request.camera)),
        "visible": observation.visible,
        "detected": np.all(np.isfinite(observation.keypoints), axis=1),
        "located": np.all(np.isfinite(observation.points), axis=1),
        **_pixels("keypoint_", observation.keypoints),
        **_axes("", observation.points),
        "error": _error(observation.points, truth),
        "mass": observation.mass,
        "height": observation.height,
        "distance_quality": observation.distance,
        "quality": observation.quality,
        "spread": _or_nan(observation.spread),
        "expected_error": _or_nan(observation.expected_error),
        "radius": _or_nan(observation.radius),
    }
    for lifting in LIFTINGS:
        reading = observation.readings[lifting]
        columns |= {f"{name}_{lifting}": values for name, values in _axes("", reading.points).items()}
        columns[f"error_{lifting}"] = _error(reading.points, truth)
        columns[f"distance_quality_{lifting}"] = reading.distance
        columns[f"quality_{lifting}"] = reading.quality
    return columns


def table_of(rows: list[tuple[Mapping[str, object], Mapping[str, AnyArray]]], schema: pa.Schema = SCHEMA) -> pa.Table:
    """The table of many frames: for each its own values, and the columns of its joints."""
    columns = []
    for field in schema:
        if field.name in rows[0][0]:
            values = np.repeat(np.array([own[field.name] for own, _ in rows]), JOINT_COUNT)
        else:
            values = np.concatenate([joints[field.name] for _, joints in rows])
        plain = field.type.value_type if pa.types.is_dictionary(field.type) else field.type
        array = pa.array(values.astype(plain.to_pandas_dtype()), plain)
        columns.append(array.dictionary_encode().cast(field.type) if plain != field.type else array)
    return pa.Table.from_arrays(columns, schema=schema)


def _axes(prefix: str, points: Float64Array) -> dict[str, AnyArray]:
    return {f"{prefix}{axis}": points[:, index] for index, axis in enumerate("xyz")}


def _pixels(prefix: str, pixels: Float64Array) -> dict[str, AnyArray]:
    return {f"{prefix}{axis}": pixels[:, index] for index, axis in enumerate("xy")}


def _error(points: Float64Array, truth: Float64Array) -> Float64Array:
    return np.linalg.norm(points - truth, axis=1)


def _or_nan(values: Float64Array | None) -> Float64Array:
    return np.full(JOINT_COUNT, np.nan) if values is None else values
