"""What the orchestrator itself has to say about a run, in a file beside its processes' logs."""

import logging
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from protocol.logs import JsonLines
from protocol.messages import Role


@contextmanager
def run_log(path: Path) -> Generator[None]:
    """While inside, everything that is logged in this process goes to a file, one JSON object a line."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(JsonLines(Role.ORCHESTRATOR))
    with logging_to(handler):
        yield


@contextmanager
def logging_to(handler: logging.Handler) -> Generator[None]:
    """Have a handler take what is logged, from INFO on; it is closed in the end."""
    root = logging.getLogger()
    level = root.level
    root.addHandler(handler)
    root.setLevel(logging.INFO)
    try:
        yield
    finally:
        root.setLevel(level)
        root.removeHandler(handler)
        handler.close()
