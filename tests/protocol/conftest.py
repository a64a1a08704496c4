"""Addresses, workers in threads, and workers in processes of their own."""

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

WORKERS = Path(__file__).parent / "workers"


@pytest.fixture
def address() -> Iterator[str]:
    """A free one, with a path short enough for a socket on every system."""
    with tempfile.TemporaryDirectory(prefix="v") as directory:
        yield f"ipc://{directory}/worker"


@pytest.fixture
def start(address: str) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Start a program of `workers/` at the address; all are gone after the test."""
    started: list[subprocess.Popen[bytes]] = []

    def start(name: str, at: str = address, *more: str) -> subprocess.Popen[bytes]:
        process = subprocess.Popen([sys.executable, WORKERS / f"{name}.py", at, *more], stderr=subprocess.DEVNULL)
        started.append(process)
        return process

    yield start
    for process in started:
        process.kill()
        process.wait()
