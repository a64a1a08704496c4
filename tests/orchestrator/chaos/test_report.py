import io

import msgspec
from msgspec.structs import replace
from rich.console import Console

from orchestrator.chaos.comparison import Comparison
from orchestrator.chaos.report import ChaosReport, ClassReport, PlayedFault, by_class, report_view

SAME = Comparison(weights=True, episodes=True, replay=True, transitions=400, lost=0, doubled=0, differences=())
FAULTS = (
    PlayedFault(scenario="kill-agent", step=100, seconds=8.0, steps_again=40),
    PlayedFault(scenario="garbage", step=150, seconds=1.0, steps_again=0),
    PlayedFault(scenario="kill-agent", step=200, seconds=4.0, steps_again=60),
    PlayedFault(scenario="kill-agent", step=300, seconds=5.0, steps_again=0),
)
REPORT = ChaosReport(
    config="c.toml",
    seed=7,
    passed=True,
    comparison=SAME,
    classes=by_class(FAULTS),
    faults=FAULTS,
    not_played=(),
    retries=3,
    late_replies=1,
    restarts={"agent": 3, "orchestrator": 0},
    control_run="runs/control",
    control_run_reused=True,
    touched="runs/seed-7",
    seconds=754.0,
)


def words(report):
    page = io.StringIO()
    Console(file=page, width=100).print(report_view(report))
    return page.getvalue()


def test_faults_are_gathered_by_class():
    assert by_class(FAULTS) == {
        "garbage": ClassReport(faults=1, median_seconds=1.0, worst_seconds=1.0, most_steps_again=0),
        "kill-agent": ClassReport(faults=3, median_seconds=5.0, worst_seconds=8.0, most_steps_again=60),
    }


def test_what_went_well_is_told_in_a_few_lines():
    said = words(REPORT)
    assert "4 faults, seed 7: equal byte for byte, after 12:34" in said
    assert "400 transitions, 0 lost, 0 doubled" in said
    assert "retries 3, late replies 1, restarts: agent 3, orchestrator 0" in said
    assert "control run: runs/control (reused)" in said


def test_whatever_went_wrong_is_told():
    broken = replace(FAULTS[0], broken="perception-0 did not survive the death of agent")
    differences = ("weights.safetensors differs from byte 12 on",)
    comparison = replace(SAME, weights=False, lost=4, differences=differences)
    said = words(
        replace(REPORT, comparison=comparison, faults=(broken,), not_played=("garbage: the run ended before it",))
    )
    assert "not equal" in said
    assert "weights DIFFERENT, episodes identical" in said
    assert "400 transitions, 4 lost" in said
    assert "weights.safetensors differs from byte 12 on" in said
    assert "kill-agent: perception-0 did not survive the death of agent" in said
    assert "not played: garbage: the run ended before it" in said


def test_programs_get_all_of_it():
    assert msgspec.json.decode(msgspec.json.encode(REPORT), type=ChaosReport) == REPORT
