from orchestrator.supervision.restart_budget import RestartBudget
from protocol.config import SupervisionConfig

CONFIG = SupervisionConfig(max_restarts=4, window=60.0, initial_backoff=0.5, max_backoff=1.5)


def test_the_first_restart_is_at_once_and_each_further_one_waits_twice_as_long():
    budget = RestartBudget(CONFIG)
    assert [budget.charge(now) for now in (0.0, 1.0, 2.0, 3.0)] == [0.0, 0.5, 1.0, 1.5]


def test_a_spent_budget_allows_no_more():
    budget = RestartBudget(CONFIG)
    for now in range(4):
        assert budget.charge(now) is not None
        budget.worked()
    assert budget.charge(59.9) is None


def test_what_is_older_than_the_window_is_forgotten():
    budget = RestartBudget(CONFIG)
    for now in range(4):
        budget.charge(now)
        budget.worked()
    assert budget.charge(60.0) == 1.5
    budget.worked()
    assert budget.charge(1000.0) == 0.0


def test_a_process_that_never_gets_ready_is_not_started_for_ever_however_long_it_takes_to_fail():
    budget = RestartBudget(CONFIG)
    assert [budget.charge(100.0 * failure) is None for failure in range(5)] == [False] * 4 + [True]


def test_the_pause_stays_finite_after_many_restarts():
    budget = RestartBudget(SupervisionConfig(max_restarts=10_000, max_backoff=10.0))
    assert max(budget.charge(0.0) or 0.0 for _ in range(5000)) == 10.0
