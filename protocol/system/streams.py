"""A command's stdout and stderr: in whatever encoding, closed before it began, or gone while it works."""

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

    stdout and stderr replace what they can't show, no file of ours takes the place of one that was closed before, and
    what is said on stderr to nobody is dropped.
    """
    _take_places_of_closed_ones()
    for stream in (sys.stdout, sys.stderr):
        _reconfigure(stream, errors="replace")
    with redirect_stderr(LastingStream(sys.stderr)):
        yield


class LastingStream(io.TextIOBase):
    """A stream to somebody who may go: what is written after that is dropped, and the work goes on."""

    def __init__(self, stream: TextIO) -> None:
        super().__init__()
        self._stream = stream
        self._lost = False

    @property
    def encoding(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The stream's."""
        return self._stream.encoding or "utf-8"

    def isatty(self) -> bool:
        """Whether a person is there."""
        return self._stream.isatty()

    def fileno(self) -> int:
        """The stream's."""
        return self._stream.fileno()

    def reconfigure(self, *, encoding: str | None = None, errors: str | None = None) -> None:
        """See `io.TextIOWrapper`."""
        _reconfigure(self._stream, encoding, errors)

    def write(self, text: str, /) -> int:
        """Write it if somebody is there."""
        if not self._lost:
            try:
                self._stream.write(text)
            except OSError as error:
                self._lose(error)
        return len(text)

    def flush(self) -> None:
        """Have what was written shown."""
        if not self._lost:
            try:
                self._stream.flush()
            except OSError as error:
                self._lose(error)

    def _lose(self, error: OSError) -> None:
        self._lost = True
        discard(self._stream)
        _log.warning("nothing is shown any more, since nobody reads stderr: %s", reason(error))


def discard(stream: TextIO) -> None:
    """Let what was or will be written to a stream that is gone go nowhere, so that the end of the process can."""
    with suppress(OSError, ValueError):
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, stream.fileno())
        os.close(nothing)
        stream.flush()


def in_utf8(stream: object) -> None:
    """Have a stream encode what is written to it as UTF-8, whatever people's encoding there."""
    _reconfigure(stream, "utf-8", "backslashreplace")


def _take_places_of_closed_ones() -> None:
    # In this order: the system gives the lowest number that is free.
    if sys.stdin is None:
        sys.stdin = os.fdopen(_nothing(os.O_RDONLY))
    if sys.stdout is None:
        # Not for writing: what was to be read by somebody is then refused as it would be by the closed one.
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
