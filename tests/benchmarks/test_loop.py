import io

import msgspec
import pytest
from msgspec.structs import replace
from rich.console import Console

from benchmarks.loop import (
    STAGES,
    Checkout,
    Measured,
    bound,
    print_all,
    rounds_table,
    stage_table,
    stages_in_the_loop,
)
from benchmarks.stages_alone import StagesAlone
from orchestrator.monitoring.report import TrainingReport

ALONE = StagesAlone(dict.fromkeys(STAGES, 0.01), updates_per_step=1.0)
REPORT = TrainingReport(
    run="run",
    interrupted=False,
    steps=1200,
    episodes=12,
    updates=1340,
    seconds=75.0,
    steps_per_second=16.0,
    stages=dict.fromkeys(STAGES, 0.02),
    late_replies=0,
    retries=0,
    restarts={},
    recycled={},
    evaluation=None,
)


def measured(name="this checkout", *speeds, alone=ALONE):
    return Measured(name, alone, [replace(REPORT, steps_per_second=speed) for speed in speeds])


def printed(found, cores=2):
    console = Console(file=io.StringIO(), width=500)
    print_all(console, found, cores)
    return console.file.getvalue()


def test_the_bound_is_cores_by_the_sum_of_the_stages():
    assert bound(ALONE, cores=2) == pytest.approx(2 / 0.08)


@pytest.mark.parametrize(("updates", "seconds"), [(0.5, 0.075), (2.0, 0.09)])
def test_in_the_bound_an_update_weighs_as_often_as_a_step_makes_it(updates, seconds):
    assert bound(replace(ALONE, updates_per_step=updates), cores=1) == pytest.approx(1 / seconds)


def test_every_stage_has_its_share_of_the_sum():
    rows = stage_table(ALONE.seconds, REPORT.stages).splitlines()
    assert rows[2] == "| render | 10.00 | 12.5% | 20.00 |"
    assert rows[-1] == "| sum | 80.0 | 100% | |"
    assert len(rows) == len(STAGES) + 3


def test_a_stage_in_the_loop_is_the_median_of_the_rounds_that_met_it():
    rounds = [replace(REPORT, stages=REPORT.stages | {"learn": value}) for value in (None, 0.03, 0.05)]
    assert stages_in_the_loop(rounds)["learn"] == pytest.approx(0.04)
    assert stages_in_the_loop(rounds[:1])["learn"] == 0.0


def test_rounds_are_compared_one_by_one_and_by_their_medians():
    table = rounds_table(measured("this checkout", 20.0, 22.0, 30.0), measured("before", 10.0, 11.0, 20.0))
    assert table.splitlines() == [
        "| round | this checkout, steps/s | before, steps/s | ratio |",
        "|---|---:|---:|---:|",
        "| 1 | 20.00 | 10.00 | 2.000 |",
        "| 2 | 22.00 | 11.00 | 2.000 |",
        "| 3 | 30.00 | 20.00 | 1.500 |",
        "| median | 22.00 | 11.00 | 2.000 |",
    ]


def test_one_checkout_is_held_against_its_bound():
    said = printed([measured("this checkout", 15.0)])
    assert "the loop: 1200 steps at 15.00 steps/s, 0 retries, 0 late replies" in said
    assert "the bound: 2 cores ÷ 80.0 ms = 25.00 steps/s, with 1 updates a step; the loop reaches 60.0% of it" in said
    assert "round" not in said


def test_a_checkout_whose_stages_could_not_be_measured_is_compared_all_the_same():
    said = printed([measured("this checkout", 15.0), measured("before", 10.0, alone=None)])
    assert "the bound is not known" in said
    assert "| 1 | 15.00 | 10.00 | 1.500 |" in said


def test_a_checkout_runs_its_own_rooms(tmp_path):
    (tmp_path / "orchestrator").mkdir()
    (tmp_path / "orchestrator" / "__init__.py").touch()
    (tmp_path / "orchestrator" / "__main__.py").write_text(
        "import sys\n"
        "from tests_report import REPORT\n"
        "assert sys.argv[1:3] == ['train', 'configs/benchmark.toml'], sys.argv\n"
        "print(REPORT)\n"
    )
    (tmp_path / "tests_report.py").write_text(f"REPORT = {msgspec.json.encode(REPORT).decode()!r}\n")
    assert Checkout("other", tmp_path).loop("configs/benchmark.toml") == REPORT


def test_a_checkout_whose_rooms_are_others_has_no_stages_alone(tmp_path, capfd):
    (tmp_path / "agent").mkdir()
    (tmp_path / "agent" / "__init__.py").write_text("raise SystemExit('these rooms are others')\n")
    assert Checkout("other", tmp_path).stages_alone(()) is None
    assert "these rooms are others" in capfd.readouterr().err
