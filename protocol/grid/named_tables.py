"""The grid tables that ship, and those that a configuration names by path."""

from pathlib import Path

from protocol.artifact import require_artifact
from protocol.grid.table import GridTable, read_table
from protocol.grid_config import GRID_TABLE

_SHIPPED = Path(__file__).parent / "shipped"


def open_table(name: str) -> GridTable:
    """The table of that name, or in the file of that path.

    Raises:
        ArtifactMissing, ArtifactDamaged: there is none, or it is damaged.
    """
    return read_table(require_artifact(table_path(name), made_by="orchestrator experiment grid build"))


def table_path(name: str) -> Path:
    """The file of a table that ships or is named by its path."""
    return Path(name) if GRID_TABLE.is_path(name) else _SHIPPED / f"{name}.msgpack"
