"""`python -m perception_worker.calibration fit TABLE --output FILE`, or `show [FILE]`."""

import argparse
import logging
import sys
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec

from perception_worker.calibration.calibration import Calibration, read_calibration, shipped
from protocol.artifact import whole_file
from protocol.errors import Unavailable, VantageError

_logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit or show; returns the exit code."""
    chosen = _parser().parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    try:
        if chosen.command == "fit":
            _fit(chosen.table, chosen.output)
        for calibration in _named(chosen):
            sys.stdout.write(msgspec.json.format(msgspec.json.encode(_told(calibration))).decode() + "\n")
    except VantageError as error:
        _logger.error("%s", error)
        return 2
    return 0


def _fit(table: Path, output: Path) -> None:
    try:
        from perception_worker.calibration import fitting
    except ImportError as error:
        raise Unavailable(f"fitting needs the extra 'fitting': {error}") from error
    _logger.info("fitting on %s (some seconds)", table)
    stored = fitting.fit(table, version=metadata.version("vantage"))
    with whole_file(output) as aside:
        aside.write_bytes(msgspec.msgpack.encode(stored))
    _logger.info("wrote %s, %d kB", output, output.stat().st_size // 1000)


def _named(chosen: argparse.Namespace) -> list[Calibration]:
    file = chosen.output if chosen.command == "fit" else chosen.file
    return shipped() if file is None else [read_calibration(file)]


def _told(calibration: Calibration) -> dict[str, Any]:
    return {"setting": calibration.setting, "provenance": calibration.provenance}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="perception_worker.calibration", description="Uncertainty in metres.")
    commands = parser.add_subparsers(dest="command", required=True)
    fitting = commands.add_parser("fit", help="fit a calibration on a table of the experiment qoe")
    fitting.add_argument("table", type=Path, metavar="TABLE", help="a Parquet file, of train identities")
    fitting.add_argument("--output", type=Path, required=True, metavar="FILE", help="where to put the calibration")
    showing = commands.add_parser("show", help="tell what a calibration is for and where it comes from")
    showing.add_argument("file", type=Path, nargs="?", metavar="FILE", help="without one, those that are shipped")
    return parser


if __name__ == "__main__":
    sys.exit(main())
