"""`python -m perception_worker.lifter fit TABLE --output FILE`, or `show [FILE]`."""

import argparse
import logging
import sys
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path

from perception_worker.fit_command import FitCommand
from perception_worker.lifter.choice import shipped
from perception_worker.lifter.lifter import Lifter
from perception_worker.lifter.stored import StoredLifter, read_stored
from protocol.errors import Unavailable

_logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit or show; returns the exit code."""
    command = FitCommand(
        prog="perception_worker.lifter",
        description="Learns where joints are in space.",
        noun="a lifter",
        table="'orchestrator lifter fit'",
        options=_add_options,
        fit=_fitted,
        read=lambda path: Lifter(read_stored(path)),
        shipped=shipped,
        written=lambda output: _training_path(output).unlink(missing_ok=True),
    )
    return command.run(arguments)


def _add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--epochs", type=int, default=40, help="passes over all views (default: 40)")
    parser.add_argument("--seed", type=int, default=0, help="of the random generators of the training (default: 0)")


def _fitted(chosen: argparse.Namespace) -> StoredLifter:
    try:
        from perception_worker.lifter.fitting.fit import fit
        from perception_worker.lifter.fitting.training import Training
    except ImportError as error:
        raise Unavailable(f"fitting needs the extra 'lifter': {error}") from error
    training = Training(epochs=chosen.epochs, seed=chosen.seed)
    return fit(
        chosen.table,
        version=metadata.version("vantage"),
        training=training,
        told=_teller(training.epochs),
        keep=_training_path(chosen.output),
    )


def _training_path(output: Path) -> Path:
    """The file of a training under way; it is removed once the lifter is written."""
    return output.with_name(f"{output.name}.training")


def _teller(epochs: int, clock: Callable[[], float] = time.monotonic) -> Callable[[int, float], None]:
    begun, first = clock(), None

    def tell(epoch: int, loss: float) -> None:
        nonlocal first
        first = epoch if first is None else first
        left = (clock() - begun) / (epoch - first + 1) * (epochs - epoch - 1)
        _logger.info("epoch %d of %d, loss %.4f, %d s left", epoch + 1, epochs, loss, left)

    return tell


if __name__ == "__main__":
    sys.exit(main())
