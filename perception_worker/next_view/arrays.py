"""The table of `orchestrator experiment next-view` as arrays: scenes that nine cameras in a 3×3 array see.

The cameras are in the table's order: row by row from the highest, each from the left, seen from behind the array.
"""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct
from numpy.typing import NDArray

from protocol.arrays import AnyArray, BoolArray, Float64Array
from protocol.camera import CameraPose, world_to_camera
from protocol.errors import InvalidInput
from protocol.joint_arrays import EVIDENCE_SIZE
from protocol.skeleton import JOINT_COUNT, upper_body_weights

CAMERAS, CENTRE = 9, 4
AROUND = np.array([camera for camera in range(CAMERAS) if camera != CENTRE])
"""The eight cameras around the centre, in order."""


class Arrays(Struct, frozen=True, eq=False, kw_only=True):
    """n scenes.

    Attributes:
        is_train: (n,) whether a scene is to learn from.
        scene: (n,) its number in its split.
        yaw: (n,) radians, the direction in which the person faces.
        person: (n, 2) metres, their place on the ground.
        position, target: (n, 9, 3) of the cameras, metres.
        intrinsics: (n, 9, 4) fx, fy, cx and cy, pixels.
        keypoints: (n, 9, 18, 2) pixels, NaN where there is none.
        points: (n, 9, 18, 3) world frame, metres, NaN where a joint was not located.
        height, quality: (n, 9, 18) in [0, 1].
        narrow, wide: (n, 9, 18, 7) evidence of a learned lifter.
        joints: (n, 18, 3) the true ones, world frame, metres.
        pictures: of the centre, as JPEG.
    """

    is_train: BoolArray
    scene: NDArray[np.int64]
    yaw: Float64Array
    person: Float64Array
    position: Float64Array
    target: Float64Array
    intrinsics: Float64Array
    keypoints: Float64Array
    points: Float64Array
    height: Float64Array
    quality: Float64Array
    narrow: Float64Array
    wide: Float64Array
    joints: Float64Array
    pictures: tuple[bytes, ...]

    def __len__(self) -> int:
        return len(self.scene)

    @property
    def uncertainty(self) -> Float64Array:
        """(n, 9) the weighted uncertainty of the upper body that each camera has, 0 to 10 (thesis, section 4.3.5)."""
        return (1.0 - self.quality) @ upper_body_weights()

    def transforms(self) -> Float64Array:
        """(n, 9, 4, 4) from the world to each camera."""
        ends = np.concatenate([self.position, self.target], axis=2).reshape(-1, 6).tolist()
        each = [world_to_camera(CameraPose((x, y, z), (to_x, to_y, to_z))) for x, y, z, to_x, to_y, to_z in ends]
        return np.stack(each).reshape(*self.position.shape[:2], 4, 4)


def read_arrays(path: Path) -> Arrays:
    """The scenes of a table.

    Raises:
        InvalidInput: it is no such table, or a scene lacks a camera.
    """
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise InvalidInput(f"{path} is no table of 'orchestrator experiment next-view': {error}") from error
    _require_whole(table, path)
    camera = _lists(table, "camera", 6)
    first = slice(None), CENTRE
    return Arrays(
        is_train=np.array(table["split"].to_pylist()[CENTRE::CAMERAS]) == "train",
        scene=_by_scene(table, "scene").astype(np.int64)[first],
        yaw=_by_scene(table, "yaw").astype(np.float64)[first],
        person=_lists(table, "person", 2)[first],
        position=camera[:, :, :3],
        target=camera[:, :, 3:],
        intrinsics=_lists(table, "intrinsics", 4),
        keypoints=_lists(table, "keypoints", JOINT_COUNT, 2),
        points=_lists(table, "points", JOINT_COUNT, 3),
        height=_lists(table, "height", JOINT_COUNT),
        quality=_lists(table, "quality", JOINT_COUNT),
        narrow=_lists(table, "narrow", JOINT_COUNT, EVIDENCE_SIZE),
        wide=_lists(table, "wide", JOINT_COUNT, EVIDENCE_SIZE),
        joints=_lists(table, "joints", JOINT_COUNT, 3)[first],
        pictures=tuple(table["picture"].to_pylist()[CENTRE::CAMERAS]),
    )


def _require_whole(table: pa.Table, path: Path) -> None:
    if {"split", "scene", "column", "row", "picture"} - set(table.column_names) or table.num_rows == 0:
        raise InvalidInput(f"{path} is no table of 'orchestrator experiment next-view'")
    grid = [(column, row) for row in (1, 0, -1) for column in (-1, 0, 1)]
    places = list(zip(table["column"].to_pylist(), table["row"].to_pylist(), strict=True))
    if table.num_rows % CAMERAS or places != grid * (len(places) // CAMERAS):
        raise InvalidInput(f"a scene of {path} lacks a camera, or has them in another order; make the table anew")
    splits = set(table["split"].to_pylist())
    if splits != {"train", "test"}:
        raise InvalidInput(f"{path} has scenes of {', '.join(sorted(splits))} alone; both splits are needed")


def _by_scene(table: pa.Table, name: str) -> AnyArray:
    return table[name].to_numpy().reshape(-1, CAMERAS)


def _lists(table: pa.Table, name: str, *shape: int) -> Float64Array:
    values = table[name].combine_chunks().flatten().to_numpy(zero_copy_only=False)
    return values.astype(np.float64).reshape(-1, CAMERAS, *shape)
