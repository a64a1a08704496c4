"""A table that is written in parts, so that a killed experiment loses only the part in work.

Each part is a Parquet file that is written atomically; when all exist, they are joined to one file and removed.
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
    """The `count` parts of the table at `path`."""

    path: Path
    count: int

    @property
    def folder(self) -> Path:
        """The directory of the parts until the table is whole."""
        return self.path.with_suffix(".parts")

    @property
    def is_whole(self) -> bool:
        """Whether the whole table exists."""
        return self.path.is_file()

    def missing(self) -> tuple[int, ...]:
        """The numbers of the parts that are not written yet."""
        if self.is_whole:
            return ()
        return tuple(number for number in range(self.count) if not self._part(number).is_file())

    def write(self, number: int, part: pa.Table) -> None:
        """Write a part atomically."""
        with whole_file(self._part(number)) as aside:
            pq.write_table(part, aside, compression=COMPRESSION)

    def join(self, metadata: Mapping[str, str]) -> None:
        """Join all parts to the table, a row group each, and remove them; does nothing if the table exists.

        Args:
            metadata: of the file.
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
