import msgspec
import pytest

from orchestrator.chaos.progress_log import Mark, ProgressLog
from protocol.records import Progress


@pytest.fixture
def write(tmp_path):
    def write(time, phase, step, *, pace=8.0, end=b"\n"):
        record = Progress(time=time, phase=phase, step=step, steps=100, episodes=0, steps_per_second=pace)
        with (tmp_path / "progress.jsonl").open("ab") as file:
            file.write(msgspec.json.encode(record) + end)

    return write


@pytest.fixture
def log(tmp_path):
    def read() -> ProgressLog:
        log = ProgressLog(tmp_path / "progress.jsonl")
        log.read()
        return log

    return read


def test_prefill_and_training_are_counted_together(write, log):
    write(1.0, "prefill", 10)
    write(2.0, "prefill", 40)
    write(3.0, "training", 8)
    assert log().marks == [Mark(1.0, 10), Mark(2.0, 40), Mark(3.0, 48)]


def test_a_line_that_a_kill_has_cut_off_is_passed_over(write, log):
    write(1.0, "training", 10)
    write(2.0, "training", 20, end=b"")
    write(3.0, "training", 12)
    write(4.0, "training", 16)
    assert [mark.step for mark in log().marks] == [10, 16]


def test_nothing_was_reached_before_the_first_word(log):
    found = log()
    assert (found.step, found.reached(5.0), found.is_done, found.lowest_after(0.0)) == (0, 0, False, None)
    assert found.first_beyond(0, 0.0) is None


def test_what_was_reached_since_the_last_line_is_taken_from_the_pace(write, log):
    write(10.0, "training", 100)
    assert log().reached(10.5) == 104
    assert log().reached(100.0) == 108


def test_a_training_that_is_set_back_has_recovered_when_it_is_beyond_where_it_was(write, log):
    write(10.0, "training", 100)
    write(15.0, "training", 60)
    write(16.0, "training", 90)
    assert log().first_beyond(100, 11.0) is None
    assert log().lowest_after(11.0) == 60
    write(17.0, "training", 101)
    assert log().first_beyond(100, 11.0) == Mark(17.0, 101)


def test_what_was_reached_long_before_a_fault_is_no_recovery_from_it(write, log):
    write(10.0, "training", 100)
    assert log().first_beyond(50, 11.0) is None


def test_the_end_of_a_training_is_beyond_every_step(write, log):
    write(10.0, "training", 96)
    write(11.0, "done", 100)
    assert log().is_done
    assert log().first_beyond(100, 10.5) == Mark(11.0, 100)
