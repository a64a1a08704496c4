"""Tables whose columns hold a value in each row, or an array of a fixed size."""

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from protocol.arrays import Float32Array


def numbers(count: int) -> pa.DataType:
    """The type of a column with `count` numbers in each row."""
    return pa.list_(pa.float32(), count)


def table_with(schema: pa.Schema, columns: Mapping[str, Sequence[object]]) -> pa.Table:
    """A table of columns, by name, each with a value or an array for each row."""
    return pa.Table.from_arrays([_column(field, columns[field.name]) for field in schema], schema=schema)


def numbers_in(table: pa.Table, name: str) -> Float32Array:
    """(rows, count) of a column whose type `numbers` made."""
    column = table[name].combine_chunks()
    return column.flatten().to_numpy().reshape(len(column), column.type.list_size)


def _column(field: pa.Field, values: Sequence[object]) -> pa.Array:
    if not pa.types.is_fixed_size_list(field.type):
        return pa.array(values, field.type)
    flat = np.concatenate([np.asarray(value).ravel() for value in values])
    inner = pa.array(flat.astype(field.type.value_type.to_pandas_dtype()), field.type.value_type)
    return pa.FixedSizeListArray.from_arrays(inner, field.type.list_size)
