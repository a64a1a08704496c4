"""The engine, the images and the run that nothing happens to: each is made once, in this order."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from protocol.artifact import cache_directory
from tests.docker.engine import Engine, NoEngine
from tests.docker.recoveries import RECOVERIES
from tests.docker.stack import HERE, Stack

BUILD_PATIENCE = 1800.0
RUN_PATIENCE = 900.0


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(item.path).parent == HERE:
            item.add_marker(pytest.mark.docker)
            item.add_marker(pytest.mark.slow)
            # The first test that needs them waits for the images and a whole training.
            item.add_marker(pytest.mark.timeout(BUILD_PATIENCE + RUN_PATIENCE))


def pytest_terminal_summary(terminalreporter):
    if RECOVERIES:
        terminalreporter.section("time to recover")
        for line in RECOVERIES.lines():
            terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def engine() -> Iterator[Engine]:
    try:
        installed = Engine.install()
    except NoEngine as error:
        pytest.skip(f"NOT RUN: {error}")
    try:
        yield installed
    finally:
        installed.down()


@pytest.fixture(scope="session")
def images(engine, tmp_path_factory) -> Engine:
    """The engine with the images built, and closed off from every other network."""
    engine.up("build")
    environment = {"LAB_WHEELS": str(_wheels(tmp_path_factory)), "LAB_ARTIFACTS": str(_artifacts(tmp_path_factory))}
    builder = Stack(
        engine, "vantage", tmp_path_factory.mktemp("no-keys"), files=(HERE / "lab.yaml",), environment=environment
    )
    started = time.monotonic()
    builder.compose("build", timeout=BUILD_PATIENCE)
    RECOVERIES.note("build of all images", time.monotonic() - started)
    engine.up("private")
    return engine


@dataclass(frozen=True)
class ControlRun:
    """A training that nothing happened to: what `up` said and how it ended, and the run, copied out of the volume."""

    output: str
    exit_code: int
    exit_codes: dict[str, int | None]
    run: Path


@pytest.fixture(scope="session")
def control_run(images, tmp_path_factory) -> ControlRun:
    folder = tmp_path_factory.mktemp("control_run")
    stack = Stack(images, "control", folder / "keys")
    stack.remove()
    started = time.monotonic()
    done = stack.try_compose("up", "--no-build", timeout=RUN_PATIENCE)
    RECOVERIES.note("a whole training that nobody disturbs", time.monotonic() - started)
    copied = folder / "run"
    shutil.copytree(stack.run_directory(), copied)
    codes = stack.exit_codes()
    stack.remove()
    return ControlRun(done.stdout, done.returncode, codes, copied)


def _wheels(tmp_path_factory) -> Path:
    """The folder that pip looks for wheels in here; an empty one where it has none."""
    asked = [sys.executable, "-m", "pip", "config", "get", "global.find-links"]
    configured = subprocess.run(asked, capture_output=True, text=True).stdout
    for place in f"{os.environ.get('PIP_FIND_LINKS', '')} {configured}".split():
        if Path(place).is_dir():
            return Path(place)
    return tmp_path_factory.mktemp("no-wheels")


def _artifacts(tmp_path_factory) -> Path:
    """What set-up has made here; an empty folder, and a build that takes minutes longer, where it was not run."""
    made = cache_directory()
    return made if made.is_dir() else tmp_path_factory.mktemp("no-artifacts")
