"""Where commands write to: a terminal that can be redrawn, or plain lines wherever that is not so."""

import errno
import os
import sys
from collections.abc import Mapping
from typing import TextIO, cast

from rich.console import Console, ConsoleDimensions

from protocol.system.streams import LastingStream

WIDTH = 80
"""Columns that everything fits into; a narrower terminal gets lines of this length, and breaks them itself."""
UNBROKEN = 1000
"""Columns where nobody's terminal is: lines are as long as they are, for programs to search."""
LEAST_LIVE_WIDTH = 60
LEAST_LIVE_HEIGHT = 12
"""Below this the view of a run would be cut."""

_REDRAWN = frozenset(
    {"alacritty", "ansi", "contour", "cygwin", "foot", "ghostty", "gnome", "iterm", "iterm2", "kitty", "konsole"}
    | {"linux", "mintty", "mlterm", "putty", "rxvt", "screen", "st", "tmux", "vt100", "vt102", "vt220", "vte"}
    | {"wezterm", "xterm"}
)
"""Families of terminals that move their cursor as we have them do; one that we don't know may be a printer."""


class _Console(Console):
    """A console that says when nobody reads it: Rich's own would end the process without a word."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def open_console(
    *, stderr: bool = False, soft_wrap: bool = False, environment: Mapping[str, str] = os.environ
) -> Console:
    """A console on stdout, whose writes fail with what the system says, or on stderr, whose writes never fail.

    It counts as a terminal only where that can be redrawn.
    """
    file = cast(TextIO, LastingStream(sys.stderr)) if stderr else None
    console = _Console(file=file, soft_wrap=soft_wrap)
    if console.is_terminal and can_be_redrawn(environment.get("TERM", ""), console.size):
        return console
    width = WIDTH if console.is_terminal else UNBROKEN
    return _Console(file=file, soft_wrap=soft_wrap, force_terminal=False, width=max(width, console.width))


def can_be_redrawn(kind: str, size: ConsoleDimensions) -> bool:
    """Whether a terminal, by its `TERM` and its size, can show a few lines that are drawn again and again."""
    family = kind.lower().partition("-")[0]
    return family in _REDRAWN and size.width >= LEAST_LIVE_WIDTH and size.height >= LEAST_LIVE_HEIGHT
