"""A command's stdout and stderr, which may have any encoding, be closed at the start, or break while it works."""

import io
import logging
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager, redirect_stderr, suppress
from typing import TextIO

from protocol.system.refusal import reason

_log = logging.getLogger(__name__)


@contextmanager
def prepared_streams() -> Generator[None]:
    """While inside, a command's streams fail only where that matters.

    stdout and stderr replace characters that they can't encode. A stream that was closed at the start gets /dev/null,
    so that no other file gets its descriptor. Text to a broken stderr is dropped.
    """
    _replace_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        _reconfigure(stream, errors="replace")
    with redirect_stderr(LastingStream(sys.stderr)):
        yield


class LastingStream(io.TextIOBase):
    """A stream whose reader may end: text written afterwards is dropped, and the work continues."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._lost = False

    @property
    def encoding(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The stream's encoding."""
        return self._stream.encoding or "utf-8"

    def isatty(self) -> bool:
        """Whether the stream is a terminal."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """The stream's descriptor."""
        return self._stream.fileno()

    def reconfigure(self, *, encoding: str | None = None, errors: str | None = None) -> None:
        """See `io.TextIOWrapper`."""
        _reconfigure(self._stream, encoding, errors)

    def write(self, text: str, /) -> int:
        """Write the text, unless the stream is broken."""
        if not self._lost:
            try:
                self._stream.write(text)
            except OSError as error:
                self._lose(error)
        return len(text)

    def flush(self) -> None:
        """Flush the stream, unless it is broken."""
        if not self._lost:
            try:
                self._stream.flush()
            except OSError as error:
                self._lose(error)

    def _lose(self, error: OSError) -> None:
        self._lost = True
        discard(self._stream)
        _log.warning("nothing is shown any more, since stderr is broken: %s", reason(error))


def discard(stream: TextIO) -> None:
    """Redirect a broken stream to /dev/null, so that flushing it at the end of the process does not fail."""
    with suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, stream.fileno())
        os.close(nothing)
        stream.flush()


def in_utf8(stream: object) -> None:
    """Make a stream encode as UTF-8, in any locale."""
    _reconfigure(stream, "utf-8", "backslashreplace")


def _replace_closed_streams() -> None:
    # In this order: the system assigns the lowest free descriptor.
    if sys.stdin is None:
        sys.stdin = os.fdopen(_nothing(os.O_RDONLY))
    if sys.stdout is None:
        # Not for writing, so that output which a program should read fails, as it would on the closed stream.
        sys.stdout = os.fdopen(_nothing(os.O_RDONLY), "w")
    if sys.stderr is None:
        sys.stderr = os.fdopen(_nothing(os.O_WRONLY), "w")


def _reconfigure(stream: object, encoding: str | None = None, errors: str | None = None) -> None:
    if isinstance(stream, io.TextIOWrapper | LastingStream):
        stream.reconfigure(encoding=encoding, errors=errors)


def _nothing(mode: int) -> int:
    descriptor = os.open(os.devnull, mode)
    os.set_inheritable(descriptor, True)
    return descriptor
