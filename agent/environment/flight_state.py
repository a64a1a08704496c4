"""A flight as plain values and arrays, and back."""

from typing import Any

import msgspec
from msgspec import Struct

from agent.environment.flight import Flight
from protocol.errors import ArtifactDamaged


def flight_state(flight: Flight) -> dict[str, Any]:
    """All of a flight, nested; arrays stay arrays."""
    return _fields(flight)


def flight_of(state: dict[str, Any]) -> Flight:
    """The flight whose state it is.

    Raises:
        ArtifactDamaged: it is no flight's.
    """
    try:
        return msgspec.convert(state, Flight, dec_hook=lambda kind, array: array)
    except msgspec.ValidationError as error:
        raise ArtifactDamaged(f"the state of a flight can't be read: {error}") from error


def _fields(struct: Struct) -> dict[str, Any]:
    values = {name: getattr(struct, name) for name in struct.__struct_fields__}
    return {name: _fields(value) if isinstance(value, Struct) else value for name, value in values.items()}
