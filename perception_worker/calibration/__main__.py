"""`python -m perception_worker.calibration fit TABLE --output FILE`, or `show [FILE]`."""

import argparse
import logging
import sys
from collections.abc import Sequence
from importlib import metadata

from perception_worker.calibration.calibration import StoredCalibration, read_calibration, shipped
from perception_worker.fit_command import FitCommand
from protocol.errors import Unavailable

_logger = logging.getLogger(__name__)


def main(arguments: Sequence[str] | None = None) -> int:
    """Fit or show; returns the exit code."""
    command = FitCommand(
        prog="perception_worker.calibration",
        description="Uncertainty in metres.",
        noun="a calibration",
        table="the experiment qoe",
        fit=_fitted,
        read=read_calibration,
        shipped=shipped,
    )
    return command.run(arguments)


def _fitted(chosen: argparse.Namespace) -> StoredCalibration:
    try:
        from perception_worker.calibration import fitting
    except ImportError as error:
        raise Unavailable(f"fitting needs the extra 'fitting': {error}") from error
    _logger.info("fitting on %s (some seconds)", chosen.table)
    return fitting.fit(chosen.table, version=metadata.version("vantage"))


if __name__ == "__main__":
    sys.exit(main())
