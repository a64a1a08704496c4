import pytest

from orchestrator.supervision.hang_detector import LONGEST_STEP, HangDetector, Patience, ProbeResult, Verdict

PATIENCE = Patience(startup=60.0, liveness=5.0, progress=20.0)
LOADING = ProbeResult(ready=False, expected=False)
IDLE = ProbeResult(ready=True, expected=True, heard=1.0)


class Polls:
    """Polls a process again and again, by a clock moved by hand."""

    def __init__(self, age: float = 0.0) -> None:
        self.now = 1000.0
        self.hang_detector = HangDetector(PATIENCE, self.now, age)

    def __call__(self, seconds: float, result, step: float = 0.5) -> Verdict:
        """The verdict after `seconds` of polls; `result` as it is, or a function of the time."""
        end, verdict = self.now + seconds, Verdict.FINE
        while self.now < end:
            self.now += step
            found = result if isinstance(result, ProbeResult) else result(self.now)
            verdict = self.hang_detector.update(found, self.now)
        return verdict


@pytest.fixture
def polls() -> Polls:
    return Polls()


def answering(**known):
    """One that answers every ping."""
    return lambda now: ProbeResult(**{"ready": True, "expected": True, "heard": now} | known)


def test_a_process_that_answers_and_has_nothing_to_do_is_fine_for_ever(polls):
    assert polls(3600.0, answering()) is Verdict.FINE


def test_a_process_that_no_longer_answers_is_silent_after_the_liveness_clock(polls):
    polls(10.0, answering())
    assert polls(5.0, IDLE) is Verdict.FINE
    assert polls(0.5, IDLE) is Verdict.SILENT


def test_one_that_answers_just_in_time_is_fine(polls):
    assert polls(300.0, lambda now: ProbeResult(ready=True, expected=True, heard=now // 4.5)) is Verdict.FINE


def test_a_process_that_loads_may_be_silent_until_the_startup_clock(polls):
    assert polls(59.5, LOADING) is Verdict.FINE
    assert polls(0.5, LOADING) is Verdict.SILENT


def test_one_that_answers_and_never_gets_ready_is_told_from_one_that_is_silent(polls):
    assert polls(60.0, answering(ready=False, expected=False)) is Verdict.NEVER_READY


def test_one_that_was_stopped_while_it_loads_is_silent_after_the_liveness_clock(polls):
    polls(30.0, LOADING)
    stopped = ProbeResult(ready=False, expected=False, stopped=True)
    assert polls(4.5, stopped) is Verdict.FINE
    assert polls(0.5, stopped) is Verdict.SILENT


def test_one_that_was_stopped_for_a_moment_while_it_loads_goes_on(polls):
    for _ in range(5):
        polls(4.0, ProbeResult(ready=False, expected=False, stopped=True))
        assert polls(0.5, LOADING) is Verdict.FINE


def test_the_startup_clock_stands_while_others_are_waited_for(polls):
    assert polls(3600.0, answering(ready=False, expected=False, waiting=True)) is Verdict.FINE
    assert polls(59.0, answering(ready=False, expected=False)) is Verdict.FINE


def test_a_process_that_was_adopted_has_part_of_its_startup_behind_it():
    assert Polls(age=50.0)(10.0, LOADING) is Verdict.SILENT


def test_an_adopted_one_has_time_to_be_heard_of_however_old_it_is():
    polls = Polls(age=1e6)
    assert polls(4.5, LOADING) is Verdict.FINE
    assert polls(0.5, LOADING) is Verdict.SILENT


def test_a_handler_that_never_ends_is_stuck_after_the_progress_clock(polls):
    stuck = answering(progress=7.0, busy=True)
    assert polls(20.0, stuck) is Verdict.FINE
    assert polls(0.5, stuck) is Verdict.STUCK


def test_a_slow_one_is_not_stuck(polls):
    assert polls(
        3600.0, lambda now: ProbeResult(ready=True, expected=True, heard=now, progress=now // 19, busy=True)
    ) is (Verdict.FINE)


def test_one_without_work_need_not_make_progress(polls):
    polls(19.0, answering(busy=True))
    polls(0.5, answering(busy=False))
    assert polls(19.5, answering(busy=True)) is Verdict.FINE


def test_one_that_waits_for_others_need_not_make_progress(polls):
    polls(19.0, answering(busy=True))
    polls(300.0, answering(busy=True, waiting=True))
    assert polls(19.5, answering(busy=True)) is Verdict.FINE


def test_time_between_polls_in_which_the_orchestrator_did_not_run_is_no_silence(polls):
    polls(10.0, answering(busy=True))
    unheard = ProbeResult(ready=True, expected=True, heard=polls.now, busy=True)
    assert polls(3600.0, unheard, step=3600.0) is Verdict.FINE
    assert polls(4.0, unheard, step=LONGEST_STEP) is Verdict.SILENT
