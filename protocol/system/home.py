"""The user's home directory, which who runs in a container under any number may not have."""

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path


def home_directory() -> Path | None:
    """Where the user is at home; None for one whom the system does not know and who has not set HOME."""
    try:
        return Path.home()
    except RuntimeError:
        return None


@contextmanager
def home_at_hand() -> Generator[None]:
    """While inside there is a home, if need be an empty one: for libraries that can't be loaded without."""
    if home_directory() is not None:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="vantage-home-") as directory:
        os.environ["HOME"] = directory
        try:
            yield
        finally:
            del os.environ["HOME"]
