"""The last warning in the logs of a run's processes, read as they grow."""

from pathlib import Path

from orchestrator.run.json_lines import Follower
from orchestrator.supervision.log_line import WARNINGS, parse_log_line
from orchestrator.supervision.worker_process import WorkerProcess


class LogWarnings:
    """Follows logs, and keeps the last warning of all."""

    def __init__(self) -> None:
        self._followers: dict[str, Follower] = {}
        self._last: str | None = None

    def follow(self, process: WorkerProcess) -> None:
        """Follow a process's log, from its own first line."""
        self.follow_file(process.name, process.log, process.log_start)

    def follow_file(self, name: str, log: Path, start: int) -> None:
        """Follow a log from a byte on; its warnings are reported as those of `name`."""
        self._followers[name] = Follower(log, start)

    def last(self) -> str | None:
        """`NAME: message` of the last warning so far; None before the first."""
        for name, follower in self._followers.items():
            for line in map(parse_log_line, follower.new_lines()):
                if line.level in WARNINGS:
                    self._last = f"{name}: {line.message}"
        return self._last
