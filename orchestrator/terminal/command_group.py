"""The group that every command of `orchestrator` is in: whatever ends one is said in a sentence, with an exit code."""

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
    """Says what ended a command in a sentence, and ends with the code that belongs to it; see `docs/exit-codes.md`."""

    def invoke(self, ctx: Any) -> Any:
        """Do the command."""
        try:
            return super().invoke(ctx)
        except VantageError as error:
            _say(str(error), error, style="yellow" if isinstance(error, Interrupted | HostNotTold) else "bold red")
            raise typer.Exit(exit_code(error)) from error
        except SYSTEM_ERRORS as error:
            _say(sentence(error), error)
            raise typer.Exit(FAILED) from error

    def main(self, *arguments: Any, **options: Any) -> Any:
        """Read the command line and do the command; what is left to be printed is printed, or that is said."""
        with prepared_streams():
            try:
                # Also around the help, which is printed before any command is done.
                with whole_output():
                    return super().main(*arguments, **options)
            except OutputLost as error:
                _say(str(error), error)
            except Exception as error:  # nobody is shown a traceback
                _say(_unforeseen(error), error)
            sys.exit(FAILED)


def exit_code(error: VantageError) -> int:
    """What a command ends with that one of our own errors ended."""
    if isinstance(error, Interrupted):
        return STOPPED
    if isinstance(error, HostNotTold):
        # What was asked for is there; that workers stay is no failure of ours.
        return DONE
    return MISUSED if isinstance(error, InvalidConfig | InvalidInput) else FAILED


def _say(words: str, error: BaseException, style: str = "bold red") -> None:
    console = open_console(stderr=True)
    for line in (words, *getattr(error, "__notes__", ())):
        console.print(line, style=style, markup=False, highlight=False, soft_wrap=True)


def _unforeseen(error: Exception) -> str:
    """What is said of an error that nobody thought of; its traceback is for whoever mends it."""
    said = f"{type(error).__name__}: {error}"
    report = "".join(traceback.format_exception(error))
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="vantage-", suffix=".log", encoding="utf-8", errors="replace", delete=False
        ) as file:
            file.write(report)
    except OSError as refused:
        return f"{said}; nobody thought of this, and its traceback can't be written down ({reason(refused)})"
    return f"{said}; nobody thought of this: please report it with the traceback in {file.name}"
