"""Exit codes, which tell the parent process whether to restart a process."""

import logging
from enum import IntEnum

from protocol.errors import CallFailed, MalformedMessage, VantageError
from protocol.system.refusal import sentence

_MAY_PASS = (CallFailed, MalformedMessage)


class ExitCode(IntEnum):
    """How a process ended. Any other code, and any signal, means `FAILED`."""

    DONE = 0
    """It finished its work, was asked to end, or ended because its orchestrator was gone."""

    HOPELESS = 2
    """It can't work with its arguments and files, so a restart changes nothing; also after a wrong command line."""

    FAILED = 3
    """It failed, and may work after a restart."""


def exit_code_of(error: BaseException) -> ExitCode:
    """The exit code after an error.

    An error of another process or of a disk may pass, and so may an unexpected one. An error that Vantage raises on
    purpose would be raised again.
    """
    if isinstance(error, VantageError) and not isinstance(error, _MAY_PASS):
        return ExitCode.HOPELESS
    return ExitCode.FAILED


def logged_exit_code_of(error: VantageError | OSError, log: logging.Logger) -> ExitCode:
    """Log the error that ends the process, which the parent process quotes, and return the exit code.

    An error of the system is logged with its traceback as well.
    """
    refused = isinstance(error, OSError)
    words = sentence(error) if refused else str(error)
    log.error("%s", words, extra={"error": type(error).__name__}, exc_info=error if refused else None)
    return exit_code_of(error)
