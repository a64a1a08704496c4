"""Log files of the orchestrator and its processes: in a run's directory, or in the cache for work outside a run."""

import logging
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
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


def log_directory() -> Path:
    """The directory for logs of processes outside a run: in the cache, or a new one where the cache is read-only."""
    logs = cache_directory() / "logs"
    try:
        require_place(logs / "log")
    except OSError:
        return Path(tempfile.mkdtemp(prefix="vantage-logs-"))
    return logs


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
