"""An environment of the grid with the views from its cells."""

from collections.abc import Mapping, Sequence

import numpy as np
from msgspec import Struct

from orchestrator.experiments.grid.views import OBSERVED_CELLS
from protocol.arrays import AnyArray, Float32Array, Float64Array
from protocol.grid.table import CELLS, GridPlace, Quantity
from protocol.pose_estimate import PoseEstimate
from protocol.scene import Scene
from protocol.skeleton import JOINT_COUNT


class ObservedEnvironment(Struct, frozen=True, eq=False, kw_only=True):
    """An environment, and what the workers answered about each view.

    Attributes:
        scene: as drawn.
        truth: (18, 3) the joints' true positions, metres, from the person's place on the ground.
        quantities: (361, 18) each, by name; the centre, which has no view, has qualities of 0 and NaN otherwise.
        points: (361, 18, 3) the joints as estimated, likewise; NaN where a joint was not located.
    """

    place: GridPlace
    scene: Scene
    truth: Float32Array
    quantities: Mapping[Quantity, Float32Array]
    points: Float32Array


def observed(
    place: GridPlace, scene: Scene, joints: Float64Array, estimates: Sequence[PoseEstimate]
) -> ObservedEnvironment:
    """An environment whose views were estimated.

    Args:
        joints: (18, 3) the true ones, world frame, metres.
        estimates: of `OBSERVED_CELLS`, in their order.
    """
    origin = np.array((*scene.position, 0.0))
    errors = [np.linalg.norm(one.points - joints, axis=1) for one in estimates]
    return ObservedEnvironment(
        place=place,
        scene=scene,
        truth=(joints - origin).astype(np.float32),
        quantities={
            "mass": _in_cells([one.mass for one in estimates], 0.0),
            "height": _in_cells([one.height for one in estimates], 0.0),
            "distance": _in_cells([one.distance for one in estimates], 0.0),
            "expected_error": _in_cells([_or_nan(one.expected_error) for one in estimates], np.nan),
            "radius": _in_cells([_or_nan(one.radius) for one in estimates], np.nan),
            "error": _in_cells(errors, np.nan),
        },
        points=_in_cells([one.points - origin for one in estimates], np.nan),
    )


def _in_cells(values: Sequence[AnyArray], in_centre: float) -> Float32Array:
    """(361, …) the values of each observed cell, and another in the centre."""
    spread = np.full((CELLS, *values[0].shape), in_centre, np.float32)
    spread[list(OBSERVED_CELLS)] = np.stack(values)
    return spread


def _or_nan(values: Float64Array | None) -> Float64Array:
    return np.full(JOINT_COUNT, np.nan) if values is None else values
