from io import StringIO

from rich.console import Console

from orchestrator.monitoring.table import evaluation_table, interval_text
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
    console = Console(width=80, record=True, file=StringIO())
    console.print(evaluation_table(evaluation))
    return console.export_text().splitlines()


def test_each_policy_has_a_row_in_the_order_of_the_evaluation():
    evaluation = Evaluation(first_seed=1_000_000, success_threshold=1.6, scores=(score("trained"), score("stay")))
    shown = lines(evaluation)
    rows = [line for line in shown if "-12.3 " in line]
    assert ["trained" in rows[0], "stay" in rows[1], len(rows)] == [True, True, 2]


def test_a_row_has_every_figure_with_its_interval_below_it():
    evaluation = Evaluation(first_seed=0, success_threshold=1.6, scores=(score("trained"),))
    shown = lines(evaluation)
    row = next(number for number, line in enumerate(shown) if "trained" in line)
    assert shown[row].split() == ["trained", "-12.3", "1.23", "55%", "0%", "100"]
    for interval in ("[-20.0, -4.5]", "[1.00, 1.50]", "[30%, 80%]", "[0%, 16%]", "[90, 100]"):
        assert interval in shown[row + 1]


def test_a_table_of_large_figures_fits_a_narrow_terminal():
    large = PolicyScore(
        policy="random",
        episodes=20,
        total_reward=Interval(-212.3, -250.1, -190.7),
        uncertainty=Interval(10.0, 10.0, 10.0),
        success=Interval(1.0, 1.0, 1.0),
        crash=Interval(1.0, 1.0, 1.0),
        length=Interval(100.0, 100.0, 100.0),
    )
    text = "\n".join(lines(Evaluation(first_seed=0, success_threshold=1.6, scores=(large,))))
    assert "random" in text
    assert "[-250.1, -190.7]" in text
    assert "…" not in text


def test_the_table_says_how_many_flights_from_which_seed_and_what_a_success_is():
    text = "\n".join(lines(Evaluation(first_seed=1_000_000, success_threshold=1.6, scores=(score("trained"),))))
    assert "20 flights" in text
    assert "1000000" in text
    assert "1.6 of 10" in text


def test_an_interval_is_its_mean_and_its_ends():
    assert interval_text(Interval(0.5, 0.25, 0.75), "{:.2f}".format) == "0.50\n[0.25, 0.75]"
