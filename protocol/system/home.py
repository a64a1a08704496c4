"""The user's home directory, which a user without a name, as in a container, may not have."""

import os
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path


def home_directory() -> Path | None:
    """The home directory; None if the system does not know the user and HOME is not set."""
    try:
        return Path.home()
    except RuntimeError:
        return None


@contextmanager
def home_at_hand() -> Generator[None]:
    """While inside, HOME exists, if need be as an empty directory: some libraries can't be loaded without."""
    if home_directory() is not None:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="vantage-home-") as directory:
        os.environ["HOME"] = directory
        try:
            yield
        finally:
            del os.environ["HOME"]
