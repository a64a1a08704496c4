"""A line of a process's log, as `protocol.system.logs` writes it."""

import msgspec
from msgspec import Struct
from msgspec.structs import replace

from protocol.text import UNDECODABLE, one_line

WARNINGS = frozenset({"warning", "error", "critical"})
ERRORS = frozenset({"error", "critical"})


class LogLine(Struct, frozen=True):
    """The message and level of a line; `level` is empty for a line that no logger wrote."""

    message: str
    level: str = ""


def parse_log_line(line: bytes) -> LogLine:
    """Parse a line: JSON, or text that a library or a crash has written between."""
    try:
        found = msgspec.json.decode(line, type=LogLine)
    except UNDECODABLE:
        found = _by_any_means(line)
    return replace(found, message=one_line(found.message))


def _by_any_means(line: bytes) -> LogLine:
    """A line that is not valid JSON, perhaps only for a byte in it that is not UTF-8."""
    text = line.decode(errors="replace")
    try:
        return msgspec.json.decode(text, type=LogLine)
    except UNDECODABLE:
        return LogLine(text)
