"""Logs for programs: one JSON object a line on stderr."""

import logging
import sys
from typing import Any, TextIO

from protocol.system.streams import in_utf8
from protocol.text import json_of

_KNOWN = frozenset(vars(logging.makeLogRecord({}))) | {"message", "asctime", "taskName"}


class JsonLines(logging.Formatter):
    """Writes a record as one line: time (seconds since 1970), level, role, logger, message, and what `extra` names."""

    def __init__(self, role: str) -> None:
        super().__init__()
        self._role = role

    def format(self, record: logging.LogRecord) -> str:
        """The line, without its end."""
        line: dict[str, Any] = {
            "time": round(record.created, 6),
            "level": record.levelname.lower(),
            "role": self._role,
            "logger": record.name,
            "message": record.getMessage(),
        }
        line |= {name: value for name, value in vars(record).items() if name not in _KNOWN}
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json_of(line).decode()


def configure(role: str, *, level: int = logging.INFO, stream: TextIO | None = None) -> None:
    """Write this process's logs and warnings to `stream` (stderr) as JSON lines, and remove other handlers."""
    handler = json_lines_to(stream or sys.stderr, role)
    root = logging.getLogger()
    for old in root.handlers[:]:
        root.removeHandler(old)
    root.addHandler(handler)
    root.setLevel(level)
    logging.captureWarnings(capture=True)


def json_lines_to(stream: TextIO, role: str) -> logging.Handler:
    """A handler that writes records to a stream as JSON lines, in UTF-8."""
    in_utf8(stream)
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonLines(role))
    return handler
