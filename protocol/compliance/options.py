"""The suite's command-line options. A plugin, since pytest reads a package's conftest after the command line."""

import argparse
import math

import pytest

from protocol.errors import AddressUnavailable
from protocol.transport.address import check_address

PATIENCE = 10.0
"""Seconds. Long, so that a worker on a busy machine passes; only a worker that fails makes the suite wait."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--worker`, `--patience` and `--drain`."""
    group = parser.getgroup("vantage", "Vantage: compliance of a worker (pytest --pyargs protocol.compliance)")
    group.addoption(
        "--worker",
        type=_address,
        metavar="ADDRESS",
        help="the worker to test, such as tcp://127.0.0.1:5555 or ipc:///tmp/render; it should have no other clients",
    )
    group.addoption(
        "--patience",
        type=_seconds,
        default=PATIENCE,
        metavar="SECONDS",
        help="how long to wait for any one answer before it counts as missing (default: %(default)g)",
    )
    group.addoption(
        "--drain", action="store_true", help="test Drain as well, at the end: the worker is gone afterwards"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Refuse pytest-xdist: several clients at once would disturb each other's tests."""
    if config.option.worker is not None and getattr(config.option, "numprocesses", None):
        raise pytest.UsageError("the compliance suite must be a worker's only client; run it without -n")


def _address(text: str) -> str:
    try:
        return check_address(text)
    except AddressUnavailable as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0 < seconds < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds above 0")
    return seconds
