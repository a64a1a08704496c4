"""Failpoints: off by default, used up once, as deadly as SIGKILL."""

import signal
import subprocess
import sys
import threading
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


def reaches(points: Failpoints, place: str) -> threading.Thread:
    """A process on the way to a place, and perhaps held there."""
    thread = threading.Thread(target=points.reach, args=(place,), daemon=True)
    thread.start()
    return thread


def test_everybody_who_reaches_a_place_that_is_held_waits_until_it_is_released(tmp_path: Path):
    points = Failpoints(tmp_path)
    points.hold("here")
    held = [reaches(points, "here"), reaches(points, "here")]
    points.reach("there")
    for thread in held:
        thread.join(0.1)
        assert thread.is_alive()
    points.release("here")
    for thread in held:
        thread.join(30)
        assert not thread.is_alive()
    points.reach("here")
    assert not list(tmp_path.iterdir())


def test_an_order_for_a_place_that_is_held_is_carried_out_when_somebody_gets_there(tmp_path: Path):
    points = Failpoints(tmp_path)
    points.hold("here")
    points.order("here", "wait 0")
    held = reaches(points, "here")
    while points.is_pending("here"):
        time.sleep(0.01)
    assert held.is_alive()
    points.release("here")
    held.join(30)


def test_nobody_is_held_by_a_process_that_has_ended(tmp_path: Path):
    program = "import sys; from pathlib import Path; from protocol.failpoint import Failpoints;"
    program += "Failpoints(Path(sys.argv[1])).hold('here')"
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], check=True)
    assert list(tmp_path.iterdir())
    Failpoints(tmp_path).reach("here")


def test_a_place_that_nobody_holds_can_be_released(tmp_path: Path):
    Failpoints(tmp_path).release("here")
