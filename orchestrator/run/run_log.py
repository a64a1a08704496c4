"""What the orchestrator and its processes have to say, in files: beside a run, or where there is none in the cache."""

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
    """While inside, everything that is logged in this process goes to a file, one JSON object a line.

    So does what ends it: people are told in a sentence, and its traceback is here alone.
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
    """Where processes write their logs that work for no run: in the cache, or where that is read-only in a new one."""
    logs = cache_directory() / "logs"
    try:
        require_place(logs / "log")
    except OSError:
        return Path(tempfile.mkdtemp(prefix="vantage-logs-"))
    return logs


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
