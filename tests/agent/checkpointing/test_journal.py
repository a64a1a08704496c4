import msgspec
import pytest
from msgspec.structs import replace
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from agent.checkpointing.journal import Journal, write_record
from protocol.records import Episode, Progress, Summary
from protocol.system.process_start import own_start

EPISODE = Episode(
    number=0, seed=5, policy="sac", total_reward=-9.5, length=100, outcome="truncated", uncertainty=1.2, success=True
)
PROGRESS = Progress(time=1.0, phase="training", step=4, steps=40, episodes=1, steps_per_second=8.0)
SUMMARY = Summary(
    steps=4, episodes=1, updates=4, seconds=0.5, steps_per_second=8.0, stages={}, late_replies=0, retries=0
)


def lines(path, kind):
    return [msgspec.json.decode(line, type=kind) for line in path.read_bytes().splitlines()]


def test_what_is_written_can_be_read_while_it_is_written(tmp_path) -> None:
    with Journal(tmp_path, clock=lambda: 5.0) as journal:
        journal.episode(EPISODE)
        journal.progress(PROGRESS)
        assert lines(tmp_path / "progress.jsonl", Progress) == [replace(PROGRESS, process=own_start(), steady=5.0)]
        assert lines(tmp_path / "episodes.jsonl", Episode) == [EPISODE]
        journal.episode(EPISODE)
    assert lines(tmp_path / "episodes.jsonl", Episode) == [EPISODE, EPISODE]


def test_a_second_journal_goes_on_where_the_first_ended(tmp_path) -> None:
    for _ in range(2):
        with Journal(tmp_path) as journal:
            journal.progress(PROGRESS)
    assert len(lines(tmp_path / "progress.jsonl", Progress)) == 2


def test_curves_are_tensorboards(tmp_path) -> None:
    with Journal(tmp_path) as journal:
        journal.curves(100, {"Loss / Critic loss": 0.5})
        journal.curves(200, {"Loss / Critic loss": 0.25})
    events = EventAccumulator(str(tmp_path / "tensorboard")).Reload()
    points = [(point.step, point.value) for point in events.Scalars("Loss / Critic loss")]
    assert points == [(100, 0.5), (200, 0.25)]


def test_without_curves_there_is_no_tensorboard_folder(tmp_path) -> None:
    with Journal(tmp_path) as journal:
        journal.progress(PROGRESS)
    assert not (tmp_path / "tensorboard").exists()


def test_a_record_is_a_file_whole_or_not_at_all(tmp_path) -> None:
    with Journal(tmp_path) as journal:
        journal.summary(SUMMARY)
    assert msgspec.json.decode((tmp_path / "summary.json").read_bytes(), type=Summary) == SUMMARY
    with pytest.raises(TypeError):
        write_record(tmp_path / "summary.json", object())  # pyright: ignore[reportArgumentType]
    assert msgspec.json.decode((tmp_path / "summary.json").read_bytes(), type=Summary) == SUMMARY
