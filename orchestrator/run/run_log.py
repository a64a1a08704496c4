"""Log files of the orchestrator and its processes: in a run's directory, or in the cache for work outside a run."""

import logging
import shutil
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

from protocol.artifact import cache_directory, require_place
from protocol.errors import Interrupted, VantageError
from protocol.messages import Role
from protocol.system.logs import JsonLines

_log = logging.getLogger(__name__)


@contextmanager
def run_log(path: Path) -> Generator[None]:
    """While inside, this process logs to a file, one JSON object a line.

    The error that ends the work is logged too: only the log has its traceback, the terminal shows a sentence.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    handler = logging.FileHandler(path, encoding="utf-8")
    handler.setFormatter(JsonLines(Role.ORCHESTRATOR))
    with logging_to(handler):
        try:
            yield
        except Interrupted as error:
            _log.info("%s", error)
            raise
        except VantageError as error:
            _log.error("%s", error)
            raise
        except Exception as error:
            _log.error("%s: %s", type(error).__name__, error, exc_info=True)
            raise


KEPT = 30 * 24 * 3600.0
"""Seconds for which logs in the cache are kept. A command that still works after that needs its own no longer."""


def log_directory() -> Path:
    """A new directory for the logs of a command's processes outside a run: in the cache, unless that is read-only.

    Each command has its own: two at the same time would read each other's warnings.
    """
    logs = cache_directory() / "logs"
    try:
        require_place(logs / "log")
        logs.mkdir(parents=True, exist_ok=True)
        own = Path(tempfile.mkdtemp(prefix=f"{datetime.now():%Y%m%d-%H%M%S}-", dir=logs))
    except OSError:
        return Path(tempfile.mkdtemp(prefix="vantage-logs-"))
    for old in logs.glob("[0-9]*-[0-9]*-*"):
        if time.time() - old.stat().st_mtime > KEPT:
            shutil.rmtree(old, ignore_errors=True)
    return own


@contextmanager
def logging_to(handler: logging.Handler) -> Generator[None]:
    """While inside, a handler takes what is logged, from INFO on; it is closed afterwards."""
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
