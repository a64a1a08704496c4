"""A line of a process's log, as `protocol.logs` writes it."""

import msgspec
from msgspec import Struct

WARNINGS = frozenset({"warning", "error", "critical"})
ERRORS = frozenset({"error", "critical"})


class LogLine(Struct, frozen=True):
    """What matters here of a line; `level` is empty for one that no logger wrote."""

    message: str
    level: str = ""


def parse_log_line(line: bytes) -> LogLine:
    """A line of JSON, or whatever a library or a crash has written between."""
    try:
        return msgspec.json.decode(line, type=LogLine)
    except msgspec.MsgspecError:
        return LogLine(line.decode(errors="replace").strip())
