"""The columns of a grid's views, before they are stored in a byte each: a row for each cell of each environment.

Lengths are metres from the person's place on the ground, along the world's axes, which are the grid's.
"""

from collections.abc import Mapping

import numpy as np
import pyarrow as pa

from orchestrator.experiments.grid.observed import ObservedEnvironment
from orchestrator.experiments.list_columns import numbers, numbers_in, table_with
from protocol.arrays import Float32Array
from protocol.errors import DamagedRecord
from protocol.grid.table import CELLS, QUANTITIES, SIDE, GridPlace, Quantity
from protocol.skeleton import JOINT_COUNT

SCHEMA = pa.schema(
    [
        pa.field("environment", pa.int16()),
        pa.field("split", pa.string()),
        pa.field("seed", pa.int64()),
        pa.field("identity", pa.int8()),
        pa.field("pose", pa.int8()),
        pa.field("yaw", pa.float64()),
        # The person's place in the world.
        pa.field("person_x", pa.float64()),
        pa.field("person_y", pa.float64()),
        pa.field("background", pa.string()),
        pa.field("ground", pa.string()),
        # The camera's place on the grid.
        pa.field("x", pa.int8()),
        pa.field("y", pa.int8()),
        *(pa.field(name, numbers(JOINT_COUNT)) for name in QUANTITIES),
        pa.field("points", numbers(3 * JOINT_COUNT)),
        pa.field("truth", numbers(3 * JOINT_COUNT)),
    ]
)


def part_of(number: int, environment: ObservedEnvironment) -> pa.Table:
    """The rows of environment `number`, its cells in order."""
    place, scene = environment.place, environment.scene
    rows, columns = np.divmod(np.arange(CELLS), SIDE)
    own = {
        "environment": number,
        "split": place.split,
        "seed": place.seed,
        "identity": place.identity,
        "pose": place.pose,
        "yaw": place.yaw,
        "person_x": scene.position[0],
        "person_y": scene.position[1],
        "background": scene.background,
        "ground": scene.ground,
        "truth": environment.truth,
    }
    views = {
        "x": columns - SIDE // 2,
        "y": rows - SIDE // 2,
        "points": environment.points,
        **environment.quantities,
    }
    return table_with(SCHEMA, {name: [value] * CELLS for name, value in own.items()} | views)


def environment_in(part: pa.Table) -> tuple[GridPlace, Float32Array, Mapping[Quantity, Float32Array]]:
    """An environment's place, the true joints (18, 3), and its quantities, (361, 18) each, out of its rows.

    Raises:
        DamagedRecord: a view is missing; the message names the environment and the cell.
    """
    first = part.slice(0, 1).to_pylist()[0]
    place = GridPlace(**{name: first[name] for name in GridPlace.__struct_fields__})
    _require_all_cells(part, place)
    truth = numbers_in(part.slice(0, 1), "truth").reshape(JOINT_COUNT, 3)
    return place, truth, {name: numbers_in(part, name) for name in QUANTITIES}


def _require_all_cells(part: pa.Table, place: GridPlace) -> None:
    there = list(zip(part["x"].to_pylist(), part["y"].to_pylist(), strict=True))
    rows, columns = np.divmod(np.arange(CELLS), SIDE)
    wanted = list(zip((columns - SIDE // 2).tolist(), (rows - SIDE // 2).tolist(), strict=True))
    if there == wanted:
        return
    missing = [cell for cell in wanted if cell not in there]
    words = f"no view from {missing[0][0]}, {missing[0][1]}" if missing else "views that are not in order"
    raise DamagedRecord(
        f"the environment of identity {place.identity}, pose {place.pose}, seed {place.seed} has {words}; "
        "build the table anew"
    )
