import errno

import pytest

from orchestrator.errors import HostNotTold, Interrupted, RunError
from orchestrator.work_record import all_work, noted_work


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_work_that_goes_on_has_a_beginning_and_no_end(tmp_path):
    with noted_work(tmp_path / "work.jsonl", "train"):
        (begun,) = all_work(tmp_path / "work.jsonl")
    assert (begun.job, begun.ending) == ("train", None)


def test_its_end_says_how_long_it_took_whatever_the_clock_on_the_wall_says(tmp_path):
    clock, wall = Clock(), Clock()
    with noted_work(tmp_path / "work.jsonl", "train", clock, wall):
        clock.now += 90.0
        wall.now -= 7200.0
    _, ended = all_work(tmp_path / "work.jsonl")
    assert (ended.ending, ended.seconds, ended.reason) == ("done", 90.0, "")


@pytest.mark.parametrize(
    ("error", "ending", "reason"),
    [
        (Interrupted("training was stopped on request"), "stopped", "training was stopped on request"),
        (KeyboardInterrupt(), "stopped", ""),
        (HostNotTold("nobody hears"), "done", "nobody hears"),
        (RunError("it is damaged"), "failed", "it is damaged"),
        (OSError(errno.ENOSPC, "No space left on device"), "failed", "No space left on device; free some space"),
        (KeyError("x"), "failed", "KeyError: 'x'"),
    ],
)
def test_its_end_says_why(tmp_path, error, ending, reason):
    with pytest.raises(type(error)), noted_work(tmp_path / "work.jsonl", "resume"):
        raise error
    _, ended = all_work(tmp_path / "work.jsonl")
    assert (ended.ending, ended.reason) == (ending, reason)


def test_work_goes_on_where_nothing_can_be_written_down(tmp_path):
    with noted_work(tmp_path, "train"):
        pass
    assert all_work(tmp_path) == ()
