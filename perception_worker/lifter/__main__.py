"""`python -m perception_worker.lifter fit TABLE --output FILE`, or `show [FILE]`."""

import argparse
import logging
import sys
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

import msgspec

from perception_worker.lifter.choice import shipped
from perception_worker.lifter.lifter import Lifter
from perception_worker.lifter.stored import read_stored
from protocol.artifact import whole_file
from protocol.errors import Unavailable, VantageError

_logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit or show; returns the exit code."""
    chosen = _parser().parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    try:
        if chosen.command == "fit":
            _fit(chosen)
        for lifter in _named(chosen):
            sys.stdout.write(msgspec.json.format(msgspec.json.encode(_told(lifter))).decode() + "\n")
    except VantageError as error:
        _logger.error("%s", error)
        return 2
    return 0


def _fit(chosen: argparse.Namespace) -> None:
    try:
        from perception_worker.lifter.fitting.fit import fit
        from perception_worker.lifter.fitting.training import Training
    except ImportError as error:
        raise Unavailable(f"fitting needs the extra 'lifter': {error}") from error
    training = Training(epochs=chosen.epochs, seed=chosen.seed)
    stored = fit(chosen.table, version=metadata.version("vantage"), training=training, told=_teller(training.epochs))
    with whole_file(chosen.output) as aside:
        aside.write_bytes(msgspec.msgpack.encode(stored))
    _logger.info("wrote %s, %d kB", chosen.output, chosen.output.stat().st_size // 1000)


def _teller(epochs: int, clock: Callable[[], float] = time.monotonic) -> Callable[[int, float], None]:
    begun = clock()

    def tell(epoch: int, loss: float) -> None:
        seconds = clock() - begun
        left = seconds / (epoch + 1) * (epochs - epoch - 1)
        _logger.info("epoch %d of %d, loss %.4f, %d s left", epoch + 1, epochs, loss, left)

    return tell


def _named(chosen: argparse.Namespace) -> list[Lifter]:
    file = chosen.output if chosen.command == "fit" else chosen.file
    return list(shipped()) if file is None else [Lifter(read_stored(file))]


def _told(lifter: Lifter) -> dict[str, Any]:
    return {"setting": lifter.setting, "provenance": lifter.provenance}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="perception_worker.lifter", description="Learns where joints are in space.")
    commands = parser.add_subparsers(dest="command", required=True)
    fitting = commands.add_parser("fit", help="fit a lifter on a table of 'orchestrator lifter fit'")
    fitting.add_argument("table", type=Path, metavar="TABLE", help="a Parquet file, of train identities")
    fitting.add_argument("--output", type=Path, required=True, metavar="FILE", help="where to put the lifter")
    fitting.add_argument("--epochs", type=int, default=60, help="how often each view is seen (default: 60)")
    fitting.add_argument("--seed", type=int, default=0, help="of what is drawn in training (default: 0)")
    showing = commands.add_parser("show", help="tell what a lifter is for and where it comes from")
    showing.add_argument("file", type=Path, nargs="?", metavar="FILE", help="without one, those that are shipped")
    return parser


if __name__ == "__main__":
    sys.exit(main())
