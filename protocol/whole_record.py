"""Records in which every field must be present: a missing one was lost, and never gets its default."""

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec
from msgspec import Struct

from protocol.errors import DamagedRecord
from protocol.text import UNDECODABLE

RecordT = TypeVar("RecordT", bound=Struct)


def lacking(table: Mapping[str, Any], record: type[Struct], prefix: str = "") -> Iterator[str]:
    """The fields of a record, and of the records in it, that a table of plain values lacks."""
    for field in msgspec.structs.fields(record):
        name = f"{prefix}{field.encode_name}"
        if field.encode_name not in table:
            yield name
        elif isinstance(value := table[field.encode_name], Mapping) and _is_record(field.type):
            yield from lacking(cast(Mapping[str, Any], value), field.type, f"{name}.")


def decode_whole(text: bytes, record: type[RecordT], *, may_lack: Collection[str] = ()) -> RecordT:
    """Decode a record from JSON that has all of its fields.

    Args:
        may_lack: names of fields that older versions did not write.

    Raises:
        msgspec.MsgspecError: it is not such a record, or lacks a field, which the message names.
    """
    table: object = msgspec.json.decode(text)
    if isinstance(table, Mapping):
        missing = [name for name in lacking(cast(Mapping[str, Any], table), record) if name not in may_lack]
        if missing:
            raise msgspec.ValidationError(f"it lacks {', '.join(missing)}")
    return msgspec.convert(table, record)


def read_whole(path: Path, record: type[RecordT], *, may_lack: Collection[str] = ()) -> RecordT:
    """Read a record that a run needs; arguments as in `decode_whole`.

    Raises:
        DamagedRecord: the file is missing, can't be read, or lacks a field.
    """
    try:
        return decode_whole(path.read_bytes(), record, may_lack=may_lack)
    except OSError as error:
        raise DamagedRecord(f"{path} can't be read: {error.strerror}; take it from a copy") from error
    except UNDECODABLE as error:
        raise DamagedRecord(f"{path} is damaged: {error}; take it from a copy") from error


def _is_record(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, Struct)
