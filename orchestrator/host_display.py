"""What a host says: a live view on a terminal, and else a log for machines, since it may run for weeks."""

import logging
from collections.abc import Generator
from contextlib import contextmanager

from rich.console import Console

from orchestrator.live_display import Display, Snapshot, open_display
from protocol import logs
from protocol.messages import Role


class _Silent:
    """Shows nothing: what changes is logged."""

    def show(self, snapshot: Snapshot) -> None:
        pass


@contextmanager
def open_host_display(console: Console) -> Generator[Display]:
    """A live view with the log above it where the console is a terminal, the log as JSON lines elsewhere."""
    if not console.is_terminal:
        logs.configure(Role.ORCHESTRATOR)
        yield _Silent()
        return
    with open_display(console) as display:
        # Only now: the live view takes care of what is written beside it.
        logging.basicConfig(format="%(asctime)s %(message)s", level=logging.INFO, force=True)
        yield display
