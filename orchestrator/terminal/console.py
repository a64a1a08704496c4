"""The consoles that commands write to: a terminal that can be redrawn, otherwise plain lines."""

import errno
import os
import sys
from collections.abc import Mapping
from typing import TextIO, cast

from rich.console import Console, ConsoleDimensions

from protocol.system.streams import LastingStream

WIDTH = 80
"""Columns that all output fits into; a narrower terminal gets lines of this length, and wraps them itself."""
UNBROKEN = 1000
"""Columns where there is no terminal: lines are not wrapped, so that programs can search them."""
LEAST_LIVE_WIDTH = 60
LEAST_LIVE_HEIGHT = 12
"""A smaller terminal would cut the view of a run."""

_REDRAWN = frozenset(
    {"alacritty", "ansi", "contour", "cygwin", "foot", "ghostty", "gnome", "iterm", "iterm2", "kitty", "konsole"}
    | {"linux", "mintty", "mlterm", "putty", "rxvt", "screen", "st", "tmux", "vt100", "vt102", "vt220", "vte"}
    | {"wezterm", "xterm"}
)
"""Families of terminals with the cursor movements that we use; an unknown one may be a printer."""


class _Console(Console):
    """A console that raises on a broken pipe: Rich's own ends the process without a message."""

    def on_broken_pipe(self) -> None:
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


def open_console(
    *, stderr: bool = False, soft_wrap: bool = False, environment: Mapping[str, str] = os.environ
) -> Console:
    """A console on stdout, whose writes fail with the system's error, or on stderr, whose writes never fail.

    It counts as a terminal only if that can be redrawn.
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
