from io import StringIO
from typing import get_args

import msgspec
from rich.console import Console

from orchestrator.monitoring.report import report_view, training_report
from orchestrator.run.restart import Restart
from protocol.records import Evaluation, Interval, PolicyScore, Stage, Summary

SUMMARY = Summary(
    steps=2000,
    episodes=30,
    updates=1800,
    seconds=250.0,
    steps_per_second=8.0,
    stages={"render": 0.05, "learn": 0.018},
    late_replies=1,
    retries=2,
)
FIGURE = Interval(0.5, 0.25, 0.75)
EVALUATION = Evaluation(
    first_seed=1_000_000,
    success_threshold=1.6,
    scores=(
        PolicyScore(
            policy="sac",
            episodes=4,
            total_reward=FIGURE,
            uncertainty=FIGURE,
            success=FIGURE,
            crash=FIGURE,
            length=FIGURE,
        ),
    ),
)


def text_of(report) -> str:
    console = Console(width=140, record=True, file=StringIO())
    console.print(report_view(report))
    return console.export_text()


def test_a_training_that_never_came_to_a_summary_has_no_report(run):
    assert training_report(run, interrupted=True) is None


def test_a_report_has_every_stage_even_one_that_was_not_measured(run):
    (run.path / "summary.json").write_bytes(msgspec.json.encode(SUMMARY))
    report = training_report(run, interrupted=False)
    assert report is not None
    assert tuple(report.stages) == get_args(Stage)
    assert (report.stages["render"], report.stages["infer"]) == (0.05, None)
    assert (report.run, report.steps, report.evaluation) == (str(run.path), 2000, None)


def test_a_report_counts_restarts_and_replacements_by_process(run):
    (run.path / "summary.json").write_bytes(msgspec.json.encode(SUMMARY))
    for process, planned in (("render-0", False), ("agent", False), ("render-0", False), ("render-0", True)):
        run.note_restart(Restart(time=1.0, process=process, reason="it ended", planned=planned))
    report = training_report(run, interrupted=False)
    assert report is not None
    assert (report.restarts, report.recycled) == ({"agent": 1, "render-0": 2}, {"render-0": 1})
    assert "restarts: agent 1, render-0 2" in text_of(report)


def test_a_report_for_people_ends_with_the_evaluation(run):
    (run.path / "summary.json").write_bytes(msgspec.json.encode(SUMMARY))
    run.evaluation_path.write_bytes(msgspec.json.encode(EVALUATION))
    text = text_of(training_report(run, interrupted=False))
    assert "trained 2000 steps in 4:10 (8.0 steps/s)" in text
    assert "render 50.0 ms · learn 18.0 ms" in text
    assert text.index("late replies 1, retries 2") < text.index("sac")


def test_an_interrupted_training_says_so(run):
    (run.path / "summary.json").write_bytes(msgspec.json.encode(SUMMARY))
    assert "stopped after 2000 steps" in text_of(training_report(run, interrupted=True))
