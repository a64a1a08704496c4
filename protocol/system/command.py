"""Runs a command, which ends with an exit code, and after an error with a sentence."""

import logging
import sys
from collections.abc import Callable

from protocol.errors import VantageError
from protocol.system.refusal import SYSTEM_ERRORS, sentence
from protocol.system.streams import discard, prepared_streams

DONE, REFUSED_BY_SYSTEM, REFUSED = 0, 1, 2

_log = logging.getLogger(__name__)


def run_command(work: Callable[[], None]) -> int:
    """Call `work` with its log on stderr; returns the exit code."""
    with prepared_streams():
        logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
        try:
            work()
            sys.stdout.flush()
        except VantageError as error:
            _log.error("%s", error)
            return REFUSED
        except SYSTEM_ERRORS as error:
            discard(sys.stdout)
            _log.error("%s", sentence(error))
            return REFUSED_BY_SYSTEM
        return DONE
