"""The root of a configuration's sections."""

from msgspec import Struct


class Section(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Root of every section: an unknown field is an error."""
