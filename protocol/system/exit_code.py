"""What a process says with its end, so that whoever started it knows whether to start it again."""

import logging
from enum import IntEnum

from protocol.errors import CallFailed, MalformedMessage, VantageError
from protocol.system.refusal import sentence

_MAY_PASS = (CallFailed, MalformedMessage)


class ExitCode(IntEnum):
    """How a process ended. Any other code, and any signal, is to be read as `FAILED`."""

    DONE = 0
    """It did what it was for, or was asked to end, or ended since its orchestrator was gone."""

    HOPELESS = 2
    """It can never work as it was started; starting it again changes nothing. A wrong command line ends so too."""

    FAILED = 3
    """It failed for now; started again, it may work."""


def exit_code_of(error: BaseException) -> ExitCode:
    """How a process ends that an error ended.

    What another process or a disk did to us may pass; what was refused on purpose will be refused again; and nothing is
    known of an error that nobody thought of.
    """
    if isinstance(error, VantageError) and not isinstance(error, _MAY_PASS):
        return ExitCode.HOPELESS
    return ExitCode.FAILED


def logged_exit_code_of(error: VantageError | OSError, log: logging.Logger) -> ExitCode:
    """Log what ended a process, for whoever started it to quote, and return its exit code.

    Where the system refused something the log has the traceback as well; people are told the sentence alone.
    """
    refused = isinstance(error, OSError)
    words = sentence(error) if refused else str(error)
    log.error("%s", words, extra={"error": type(error).__name__}, exc_info=error if refused else None)
    return exit_code_of(error)
