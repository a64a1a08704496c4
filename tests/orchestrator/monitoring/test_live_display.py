from io import StringIO

import pytest
from rich.console import Console

from orchestrator.monitoring.live_display import (
    LINE_INTERVAL,
    FrameCount,
    LineDisplay,
    LiveDisplay,
    Snapshot,
    duration,
    open_display,
    snapshot_line,
    snapshot_view,
)
from orchestrator.supervision.heartbeat import Health
from protocol.messages import Role
from protocol.records import Progress
from tests.orchestrator.clock import Clock

PROGRESS = Progress(
    time=0.0,
    phase="training",
    step=50,
    steps=200,
    episodes=3,
    steps_per_second=10.0,
    episode_return=-12.34,
    uncertainty=2.345,
    stages={"render": 0.0531, "infer": 0.066},
)
SNAPSHOT = Snapshot(
    activity="training",
    elapsed=75.0,
    progress=PROGRESS,
    workers=(
        Health(
            name="render-0",
            role=Role.RENDER,
            pid=1234,
            state="busy",
            answered=50,
            queue_depth=1,
            resident_bytes=300 * 2**20,
        ),
        Health(name="agent", role=Role.AGENT, pid=1235, state="running"),
    ),
    warning="render-0: out of [brown] paint",
)


def text_of(renderable: object) -> str:
    console = Console(width=120, record=True, file=StringIO())
    console.print(renderable)
    return console.export_text()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def console() -> Console:
    return Console(file=StringIO(), width=200)


def written(console: Console) -> list[str]:
    return console.file.getvalue().splitlines()


def test_an_experiment_is_shown_by_its_frames_its_speed_and_the_time_that_is_left():
    count = FrameCount(step=50, steps=200, steps_per_second=10.0)
    snapshot = Snapshot(activity="observing test people", elapsed=5.0, progress=count)
    assert snapshot_line(snapshot) == "0:05  observing test people  50/200 frames  10.0 frames/s  0:15 left"
    assert "0:15 left" in text_of(snapshot_view(snapshot))


def test_a_line_has_all_that_matters():
    assert snapshot_line(SNAPSHOT) == (
        "1:15  training  training 50/200  10.0 steps/s  return -12.3  uncertainty 2.35  render-0 busy, agent running"
    )


def test_before_the_agents_first_word_a_line_has_no_figures():
    assert snapshot_line(Snapshot(activity="waiting for render-0", elapsed=3.0)) == "0:03  waiting for render-0"


def test_the_view_has_the_figures_the_stages_the_workers_and_the_last_warning():
    text = text_of(snapshot_view(SNAPSHOT))
    for part in ("50/200", "0:15 left", "10.0 steps/s", "return -12.3", "uncertainty 2.35", "render 53.1 ms"):
        assert part in text
    assert "out of [brown] paint" in text
    worker = next(line for line in text.splitlines() if line.startswith("render-0"))
    assert worker.split() == ["render-0", "busy", "50", "1", "300", "MiB", "1234"]


def test_lines_come_every_few_seconds_and_at_once_when_the_activity_changes(console, clock):
    display = LineDisplay(console, clock)
    first = Snapshot(activity="waiting", elapsed=0.0)
    display.show(first)
    clock.now += LINE_INTERVAL / 2
    display.show(first)
    assert len(written(console)) == 1
    display.show(Snapshot(activity="training", elapsed=1.0))
    assert len(written(console)) == 2
    clock.now += LINE_INTERVAL
    display.show(Snapshot(activity="training", elapsed=6.0))
    assert [line.split("  ")[1] for line in written(console)] == ["waiting", "training", "training"]


def test_a_warning_is_written_once(console, clock):
    display = LineDisplay(console, clock)
    for _ in range(3):
        display.show(SNAPSHOT)
    assert written(console).count("warning: render-0: out of [brown] paint") == 1


def test_a_terminal_gets_a_live_view_and_a_file_gets_lines(console):
    with open_display(console) as display:
        assert isinstance(display, LineDisplay)
    terminal = Console(file=StringIO(), force_terminal=True, width=120)
    with open_display(terminal) as display:
        assert isinstance(display, LiveDisplay)
        display.show(SNAPSHOT)
        assert "50/200" in terminal.file.getvalue()


@pytest.mark.parametrize(("seconds", "text"), [(0, "0:00"), (59.9, "0:59"), (61, "1:01"), (3725, "1:02:05")])
def test_durations_read_like_a_clock(seconds, text):
    assert duration(seconds) == text
