"""What holds for every test: a busy machine is no failure, so hypothesis's examples have no time limit."""

import pytest
from hypothesis import settings

FEW, ALL = "few-examples", "vantage"
"""Profiles of hypothesis: `make check` takes the first, every whole run the other."""

settings.register_profile(ALL, deadline=None)
settings.register_profile(FEW, parent=settings.get_profile(ALL), max_examples=25)


def pytest_configure(config: pytest.Config) -> None:
    """Take all examples, unless the command line names another profile."""
    if config.getoption("--hypothesis-profile", default=None) is None:
        settings.load_profile(ALL)
