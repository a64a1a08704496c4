"""`fit TABLE --output FILE` and `show [FILE]`, for models fitted on people whose truth is known."""

import argparse
import logging
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol

import msgspec
from msgspec import Struct

from protocol.artifact import require_place, whole_file
from protocol.system.command import run_command

_logger = logging.getLogger(__name__)


class Fitted(Protocol):
    """A fitted model that knows its network and its origin."""

    @property
    def setting(self) -> Struct:
        """The network that it was fitted behind."""
        ...

    @property
    def provenance(self) -> Struct:
        """Its origin."""
        ...


class FitCommand(Struct, frozen=True, kw_only=True):
    """A room's command.

    Attributes:
        noun: the model, with its article.
        table: the name of its table.
        options: adds the model's own options to `fit`.
        fit: fits a model by the arguments; it is written to their `output`.
        read, shipped: a model out of a file, and those that come with the package.
        written: called with the output once it is in place.
    """

    prog: str
    description: str
    noun: str
    table: str
    options: Callable[[argparse.ArgumentParser], None] = lambda parser: None
    fit: Callable[[argparse.Namespace], Struct]
    read: Callable[[Path], Fitted]
    shipped: Callable[[], Iterable[Fitted]]
    written: Callable[[Path], None] = lambda output: None

    def run(self, arguments: Sequence[str] | None) -> int:
        """Fit or show; returns the exit code."""
        chosen = self._parser().parse_args(arguments)
        return run_command(lambda: self._do(chosen))

    def _do(self, chosen: argparse.Namespace) -> None:
        if chosen.command == "fit":
            # Before the fit, which takes long.
            require_place(chosen.output)
            self._write(self.fit(chosen), chosen.output)
        file = chosen.output if chosen.command == "fit" else chosen.file
        for fitted in self.shipped() if file is None else [self.read(file)]:
            told = {"setting": fitted.setting, "provenance": fitted.provenance}
            sys.stdout.write(msgspec.json.format(msgspec.json.encode(told)).decode() + "\n")

    def _write(self, stored: Struct, output: Path) -> None:
        with whole_file(output) as aside:
            aside.write_bytes(msgspec.msgpack.encode(stored))
        self.written(output)
        _logger.info("wrote %s, %d kB", output, output.stat().st_size // 1000)

    def _parser(self) -> argparse.ArgumentParser:
        parser = argparse.ArgumentParser(prog=self.prog, description=self.description)
        commands = parser.add_subparsers(dest="command", required=True)
        fitting = commands.add_parser("fit", help=f"fit {self.noun} on a table of {self.table}")
        fitting.add_argument("table", type=Path, metavar="TABLE", help="a Parquet file, of train identities")
        fitting.add_argument("--output", type=Path, required=True, metavar="FILE", help="where to write it")
        self.options(fitting)
        showing = commands.add_parser("show", help=f"show the setting and the origin of {self.noun}")
        showing.add_argument("file", type=Path, nargs="?", metavar="FILE", help="default: those that are shipped")
        return parser
