"""The output of commands on stdout: all of it arrives, or the command fails with a sentence."""

import sys
from collections.abc import Generator
from contextlib import contextmanager

import msgspec
from msgspec import Struct
from rich.console import RenderableType

from orchestrator.errors import OutputLost
from orchestrator.terminal.console import open_console
from protocol.system.refusal import sentence
from protocol.system.streams import discard
from protocol.text import json_of


def show(renderable: RenderableType, *, soft_wrap: bool = False) -> None:
    """Print formatted text; errors as `whole_output`."""
    with whole_output():
        open_console(soft_wrap=soft_wrap).print(renderable)


def print_line(text: object) -> None:
    """Print a line unformatted; errors as `whole_output`."""
    with whole_output():
        sys.stdout.write(f"{text}\n")


def print_json(value: Struct | tuple[Struct, ...]) -> None:
    """Print values as JSON, in UTF-8 whatever the terminal's encoding; errors as `whole_output`."""
    with whole_output():
        sys.stdout.flush()
        sys.stdout.buffer.write(msgspec.json.format(json_of(value), indent=2) + b"\n")


@contextmanager
def whole_output() -> Generator[None]:
    """Flush stdout after the work inside.

    Raises:
        OutputLost: the system did not take all of the output.
    """
    try:
        try:
            yield
        finally:
            sys.stdout.flush()
    except OSError as error:
        discard(sys.stdout)
        raise OutputLost(f"the output can't be written to stdout: {sentence(error)}") from error
