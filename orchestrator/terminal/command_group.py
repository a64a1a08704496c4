"""The group of all commands: it turns the error that ends a command into a sentence and an exit code."""

import sys
import tempfile
import traceback
from typing import Any

import typer
from typer.core import TyperGroup

from orchestrator.errors import HostNotTold, OutputLost
from orchestrator.terminal.console import open_console
from orchestrator.terminal.output import whole_output
from protocol.errors import Interrupted, InvalidConfig, InvalidInput, VantageError
from protocol.system.refusal import SYSTEM_ERRORS, reason, sentence
from protocol.system.streams import prepared_streams

DONE, FAILED, MISUSED, STOPPED = 0, 1, 2, 130


class Sentences(TyperGroup):
    """Prints the error that ended a command as a sentence, and exits with its code; see `docs/exit-codes.md`."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except VantageError as error:
            _say(str(error), error, style="yellow" if isinstance(error, Interrupted | HostNotTold) else "bold red")
            raise typer.Exit(exit_code(error)) from error
        except SYSTEM_ERRORS as error:
            _say(sentence(error), error)
            raise typer.Exit(FAILED) from error

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Parse the command line and run the command; fails where its output can't be written."""
        with prepared_streams():
            try:
                # Around the help too, which is printed before any command runs.
                with whole_output():
                    return super().main(*arguments, **options)
            except OutputLost as error:
                _say(str(error), error)
            except Exception as error:  # a traceback goes to a file, not to the terminal
                _say(_unforeseen(error), error)
            sys.exit(FAILED)


def exit_code(error: VantageError) -> int:
    """The exit code of a command that one of our own errors ended."""
    if isinstance(error, Interrupted):
        return STOPPED
    if isinstance(error, HostNotTold):
        # The run itself is done; that the host's workers go on is no failure of it.
        return DONE
    return MISUSED if isinstance(error, InvalidConfig | InvalidInput) else FAILED


def _say(words: str, error: BaseException, style: str = "bold red") -> None:
    console = open_console(stderr=True)
    for line in (words, *getattr(error, "__notes__", ())):
        console.print(line, style=style, markup=False, highlight=False, soft_wrap=True)


def _unforeseen(error: Exception) -> str:
    """The message for an error without a message of its own; its traceback goes to a file, for a bug report."""
    said = f"{type(error).__name__}: {error}"
    report = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="vantage-", suffix=".log", encoding="utf-8", errors="replace", delete=False
        ) as file:
            file.write(report)
    except OSError as refused:
        return f"{said}; this is a bug, and its traceback can't be saved ({reason(refused)})"
    return f"{said}; this is a bug: please report it with the traceback in {file.name}"
