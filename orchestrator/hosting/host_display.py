"""What a host says: a live view on a terminal, and else a log for machines, since it may run for weeks."""

import logging
import sys
from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console

from orchestrator.monitoring.live_display import Display, Snapshot, open_display
from orchestrator.run.run_log import logging_to
from protocol.messages import Role
from protocol.system.logs import json_lines_to


class _Silent:
    """Shows nothing: what changes is logged."""

    def show(self, snapshot: Snapshot) -> None:
        pass


@contextmanager
def open_host_display(console: Console) -> Generator[Display]:
    """A live view with the log above it where the console is a terminal, the log as JSON lines remote_workers."""
    if not console.is_terminal:
        with logging_to(json_lines_to(sys.stderr, Role.ORCHESTRATOR)):
            yield _Silent()
        return
    with open_display(console) as display:
        # Within the view, which takes care of what is written beside it.
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
        with logging_to(handler):
            yield display
