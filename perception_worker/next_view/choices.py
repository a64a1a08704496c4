"""What each way of choosing expects of the eight cameras around the centre: the result of this package's command."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct

from perception_worker.next_view.arrays import AROUND, Arrays
from protocol.arrays import Float64Array
from protocol.artifact import whole_file


class Choices(Struct, frozen=True, eq=False, kw_only=True):
    """One way of choosing, for all scenes.

    Attributes:
        group: of similar ways.
        method: its name.
        seed: of its training.
        expected: (n, 8) of the cameras around the centre, in order; the lowest is chosen.
    """

    group: str
    method: str
    seed: int
    expected: Float64Array


SCHEMA = pa.schema(
    [
        pa.field("group", pa.string()),
        pa.field("method", pa.string()),
        pa.field("seed", pa.int16()),
        pa.field("split", pa.string()),
        pa.field("scene", pa.int32()),
        pa.field("expected", pa.list_(pa.float32(), len(AROUND))),
    ]
)


def write_choices(path: Path, arrays: Arrays, all_choices: Iterable[Choices]) -> None:
    """Write the choices as a Parquet file, atomically."""
    with whole_file(path) as aside, pq.ParquetWriter(aside, SCHEMA, compression="zstd") as writer:
        for choices in all_choices:
            writer.write_table(_table(arrays, choices))


def _table(arrays: Arrays, choices: Choices) -> pa.Table:
    expected = pa.array(choices.expected.astype(np.float32).ravel(), pa.float32())
    return pa.table(
        {
            "group": [choices.group] * len(arrays),
            "method": [choices.method] * len(arrays),
            "seed": [choices.seed] * len(arrays),
            "split": np.where(arrays.is_train, "train", "test").tolist(),
            "scene": arrays.scene.tolist(),
            "expected": pa.FixedSizeListArray.from_arrays(expected, len(AROUND)),
        },
        schema=SCHEMA,
    )
