"""Failpoints: off by default, used up once, as deadly as SIGKILL."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from protocol.errors import InvalidInput
from protocol.failpoint import VARIABLE, Failpoints, failpoint_of, no_failpoint


def test_nothing_happens_unless_the_environment_asks_for_it():
    assert failpoint_of({}) is no_failpoint


def test_an_order_is_carried_out_once_and_at_its_place_only(tmp_path: Path):
    points = Failpoints(tmp_path)
    points.order("here", "wait 0.2")
    points.reach("there")
    assert points.is_pending("here")
    begun = time.monotonic()
    points.reach("here")
    assert time.monotonic() - begun >= 0.2
    assert not points.is_pending("here")
    assert not list(tmp_path.iterdir())


def test_an_order_can_be_taken_back(tmp_path: Path):
    points = Failpoints(tmp_path)
    points.order("here", "kill")
    points.cancel("here")
    points.reach("here")


@pytest.mark.parametrize("what", ["", "die", "wait", "wait long"])
def test_what_is_no_order_is_refused_when_it_is_given(tmp_path: Path, what: str):
    with pytest.raises(InvalidInput, match="failpoint"):
        Failpoints(tmp_path).order("here", what)


def test_a_process_that_is_told_to_die_ends_as_if_killed(tmp_path: Path):
    Failpoints(tmp_path).order("here", "kill")
    program = "import os; from protocol.failpoint import failpoint_of; failpoint_of(os.environ)('here'); print('alive')"
    done = subprocess.run(
        [sys.executable, "-c", program], env={VARIABLE: str(tmp_path)}, stdout=subprocess.PIPE, check=False
    )
    assert done.returncode == -signal.SIGKILL
    assert done.stdout == b""
