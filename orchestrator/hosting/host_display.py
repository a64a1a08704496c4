"""The display of a host: a live view on a terminal, otherwise a log for machines, since it may run for weeks."""

import logging
import sys
from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console

from orchestrator.monitoring.live_display import Display, SilentDisplay, open_display
from orchestrator.run.run_log import logging_to
from protocol.messages import Role
from protocol.system.logs import json_lines_to


@contextmanager
def open_host_display(console: Console) -> Generator[Display]:
    """A live view with the log above it where the console is a terminal; otherwise the log as JSON lines."""
    if not console.is_terminal:
        with logging_to(json_lines_to(sys.stderr, Role.ORCHESTRATOR)):
            yield SilentDisplay()
        return
    with open_display(console) as display:
        # Within the live view, which prints above itself what is written to the terminal.
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("%(asctime)s %(message)s"))
        with logging_to(handler):
            yield display
