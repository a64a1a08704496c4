"""A table that grows by whole parts, so that a killed experiment loses the part under way and nothing else.

Each part is a Parquet file that appears whole or not at all; when all are there, they become one file and go.
"""

import shutil
from collections.abc import Mapping
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct

from protocol.artifact import whole_file

COMPRESSION = "zstd"


class Parts(Struct, frozen=True):
    """The parts of the table that is to be `path`, `count` in all."""

    path: Path
    count: int

    @property
    def folder(self) -> Path:
        """Where the parts are until the table is whole."""
        return self.path.with_suffix(".parts")

    @property
    def is_whole(self) -> bool:
        """Whether the table is there."""
        return self.path.is_file()

    def missing(self) -> tuple[int, ...]:
        """The parts that are still to be written."""
        if self.is_whole:
            return ()
        return tuple(number for number in range(self.count) if not self._part(number).is_file())

    def write(self, number: int, part: pa.Table) -> None:
        """Write a part, whole or not at all."""
        with whole_file(self._part(number)) as aside:
            pq.write_table(part, aside, compression=COMPRESSION)

    def join(self, metadata: Mapping[str, str]) -> None:
        """Make the table of all parts, a row group each, and let the parts go; nothing where it is there already.

        Args:
            metadata: what the file is to tell of itself.
        """
        if not self.is_whole:
            with whole_file(self.path) as aside:
                self._write_whole(aside, metadata)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _write_whole(self, path: Path, metadata: Mapping[str, str]) -> None:
        schema = pq.read_schema(self._part(0)).with_metadata(dict(metadata))
        with pq.ParquetWriter(path, schema, compression=COMPRESSION) as writer:
            for number in range(self.count):
                writer.write_table(pq.read_table(self._part(number)).cast(schema))

    def _part(self, number: int) -> Path:
        return self.folder / f"part-{number:05d}.parquet"
