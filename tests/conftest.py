"""What holds for every test: a busy machine is no failure, so hypothesis's examples have no time limit.

A command that a test runs in its own process sets up that process's log; it is as before after the test.
"""

import logging
import os
from collections.abc import Generator

import pytest
from hypothesis import settings

# Before any library is loaded that computes in threads: on cores with other work they mostly wait for each other, and a
# fit of seconds takes minutes.
os.environ.setdefault("OMP_NUM_THREADS", "1")

FEW, ALL = "few-examples", "vantage"
"""Profiles of hypothesis: `make check` takes the first, every whole run the other."""

settings.register_profile(ALL, deadline=None)
settings.register_profile(FEW, parent=settings.get_profile(ALL), max_examples=25)


def pytest_configure(config: pytest.Config) -> None:
    """Take all examples, unless the command line names another profile."""
    if config.getoption("--hypothesis-profile", default=None) is None:
        settings.load_profile(ALL)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol() -> Generator[None, object, object]:
    """Give the root logger back what it had: what a test leaves there would write to a stream that is closed."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    try:
        return (yield)
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
