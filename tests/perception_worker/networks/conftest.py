"""What the tests of networks share: an empty cache, and packages of tiny networks."""

import pytest

from tests.perception_worker.tiny_package import write_wheel


@pytest.fixture
def cache(tmp_path, monkeypatch):
    directory = tmp_path / "cache"
    directory.mkdir()
    monkeypatch.setenv("VANTAGE_CACHE", str(directory))
    return directory


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """A tiny package, and pip told to look for packages where it lies and nowhere else."""
    shelf = tmp_path / "shelf"
    shelf.mkdir()
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(shelf))
    return write_wheel(shelf)
