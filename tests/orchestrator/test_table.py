from io import StringIO

from rich.console import Console

from orchestrator.table import evaluation_table, interval_text
from protocol.records import Evaluation, Interval, PolicyScore


def score(policy: str) -> PolicyScore:
    return PolicyScore(
        policy=policy,
        episodes=20,
        total_reward=Interval(-12.34, -20.0, -4.5),
        uncertainty=Interval(1.234, 1.0, 1.5),
        success=Interval(0.55, 0.3, 0.8),
        crash=Interval(0.0, 0.0, 0.16),
        length=Interval(99.6, 90.0, 100.0),
    )


def lines(evaluation: Evaluation) -> list[str]:
    console = Console(width=140, record=True, file=StringIO())
    console.print(evaluation_table(evaluation))
    return console.export_text().splitlines()


def test_each_policy_has_a_row_in_the_order_of_the_evaluation():
    evaluation = Evaluation(first_seed=1_000_000, success_threshold=1.6, scores=(score("trained"), score("stay")))
    shown = lines(evaluation)
    rows = [line for line in shown if "-12.3" in line]
    assert ["trained" in rows[0], "stay" in rows[1], len(rows)] == [True, True, 2]


def test_a_row_has_every_figure_with_its_interval():
    evaluation = Evaluation(first_seed=0, success_threshold=1.6, scores=(score("trained"),))
    row = next(line for line in lines(evaluation) if "trained" in line)
    for figure in ("-12.3 [-20.0, -4.5]", "1.23 [1.00, 1.50]", "55% [30%, 80%]", "0% [0%, 16%]", "100 [90, 100]"):
        assert figure in row


def test_the_table_says_how_many_flights_from_which_seed_and_what_a_success_is():
    text = "\n".join(lines(Evaluation(first_seed=1_000_000, success_threshold=1.6, scores=(score("trained"),))))
    assert "20 flights" in text
    assert "1000000" in text
    assert "1.6 of 10" in text


def test_an_interval_is_its_mean_and_its_ends():
    assert interval_text(Interval(0.5, 0.25, 0.75), "{:.2f}".format) == "0.50 [0.25, 0.75]"
