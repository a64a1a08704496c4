"""What a host says: a live view on a terminal, and else a log for machines, since it may run for weeks."""

import logging
from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console

from orchestrator.live_display import Display, Snapshot, open_display
from orchestrator.run_log import logging_to
from protocol.logs import JsonLines
from protocol.messages import Role


class _Silent:
    """Shows nothing: what changes is logged."""

    def show(self, snapshot: Snapshot) -> None:
        pass


@contextmanager
def open_host_display(console: Console) -> Generator[Display]:
    """A live view with the log above it where the console is a terminal, the log as JSON lines elsewhere."""
    if not console.is_terminal:
        with _log_to_stderr(JsonLines(Role.ORCHESTRATOR)):
            yield _Silent()
        return
    # The log within the view, which takes care of what is written beside it.
    with open_display(console) as display, _log_to_stderr(logging.Formatter("%(asctime)s %(message)s")):
        yield display


@contextmanager
def _log_to_stderr(formatter: logging.Formatter) -> Generator[None]:
    handler = logging.StreamHandler()
    handler.setFormatter(formatter)
    with logging_to(handler):
        yield
