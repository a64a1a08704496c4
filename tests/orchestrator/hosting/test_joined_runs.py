from orchestrator.hosting.joined_runs import JoinedRuns
from protocol.messages import Role, State, WorkerRecord

LIVENESS, GRACE = 5.0, 60.0


class Runs(JoinedRuns):
    def __init__(self) -> None:
        self.now = 100.0
        super().__init__(LIVENESS, GRACE, lambda: self.now)

    def beat(self, name: str, incarnation: str) -> None:
        self.note(WorkerRecord(role=Role.AGENT, address="", incarnation=incarnation, state=State.READY, name=name))


def test_before_any_run_is_done_nothing_is_over():
    runs = Runs()
    assert not runs.are_done()
    runs.beat("monday", "a")
    runs.now += 2 * GRACE
    assert (runs.under_way(), runs.are_done()) == ((), False)


def test_all_is_over_when_the_last_of_the_runs_is_done():
    runs = Runs()
    runs.beat("monday", "a")
    runs.beat("tuesday", "b")
    runs.dismiss("a")
    assert (runs.under_way(), runs.are_done()) == (("tuesday",), False)
    runs.dismiss("b")
    assert runs.are_done()


def test_a_late_word_of_a_run_that_is_done_starts_nothing_anew():
    runs = Runs()
    runs.beat("monday", "a")
    runs.dismiss("a")
    runs.beat("monday", "a")
    assert runs.are_done()


def test_a_run_that_is_done_twice_is_done_and_one_that_nobody_knows_as_well():
    runs = Runs()
    runs.dismiss("a")
    runs.dismiss("a")
    assert runs.are_done()


def test_a_run_that_fell_silent_without_a_word_is_waited_for_as_long_as_workers_wait_for_a_host():
    runs = Runs()
    runs.beat("monday", "a")
    runs.dismiss("a")
    runs.beat("tuesday", "b")
    runs.now += GRACE - 1
    assert not runs.are_done()
    runs.now += 1
    assert runs.are_done()


def test_a_killed_run_whose_successor_is_done_is_waited_for_no_longer_than_it_is_listed():
    runs = Runs()
    runs.beat("monday", "killed")
    runs.now += 1
    runs.beat("monday", "successor")
    runs.dismiss("successor")
    assert not runs.are_done()
    runs.now += LIVENESS - 1
    assert runs.are_done()


def test_of_two_runs_of_one_name_each_is_waited_for():
    runs = Runs()
    runs.beat("monday", "here")
    runs.now += 1
    runs.beat("monday", "there")
    runs.dismiss("there")
    for _ in range(20):
        runs.now += 1
        runs.beat("monday", "here")
        assert not runs.are_done()
    runs.dismiss("here")
    assert runs.are_done()


def test_a_run_that_comes_later_reopens_what_was_over():
    runs = Runs()
    runs.dismiss("a")
    runs.beat("tuesday", "b")
    assert not runs.are_done()
