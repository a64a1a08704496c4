from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from agent.checkpointing.replay_journal import ReplayJournal, require_segments, row_type
from agent.errors import JournalDamaged
from agent.learning.learner import Transition
from tests.agent.checkpointing.full_disk import no_file_larger_than
from tests.agent.learning.learners import stacked

DRONES = 3
ROWS_IN_A_SEGMENT = 4
SEGMENT = ROWS_IN_A_SEGMENT * row_type(DRONES, 111).itemsize


def steps(count: int, seed: int = 0) -> list[Transition]:
    rng = np.random.default_rng(seed)
    return [
        Transition(
            observations=rng.normal(size=(DRONES, 111)).astype(np.float32),
            actions=rng.normal(size=(DRONES, 3)).astype(np.float32),
            rewards=rng.normal(size=DRONES),
            next_observations=rng.normal(size=(DRONES, 111)).astype(np.float32),
            terminated=rng.random(DRONES) < 0.5,
            truncated=rng.random(DRONES) < 0.5,
        )
        for _ in range(count)
    ]


def journal(directory: Path, segments=()) -> ReplayJournal:
    return ReplayJournal(directory, DRONES, 111, segments, segment_bytes=SEGMENT)


def filled(directory: Path, count: int) -> tuple:
    with journal(directory) as one:
        for step in steps(count):
            one.append(step)
        return one.sync()


def content(directory: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(directory.iterdir())}


def assert_same(found: list[Transition], expected: list[Transition]) -> None:
    assert sum(len(piece.rewards) for piece in found) == len(expected)
    whole = stacked(expected)
    for name in Transition.__struct_fields__:
        assert_array_equal(np.concatenate([getattr(piece, name) for piece in found]), getattr(whole, name))


@pytest.mark.parametrize("last", [1, 3, 4, 5, 9, 10])
def test_the_last_steps_come_back_in_order_over_segments(tmp_path, last: int) -> None:
    with journal(tmp_path / "replay") as one:
        for step in steps(10):
            one.append(step)
        one.sync()
        assert_same(list(one.last(last)), steps(10)[-last:])
    assert list(content(tmp_path / "replay")) == ["000000.bin", "000001.bin", "000002.bin"]


def test_none_of_the_last_steps_is_nothing(tmp_path) -> None:
    with journal(tmp_path / "replay") as one:
        assert list(one.last(0)) == []


def test_the_bytes_do_not_depend_on_when_it_was_synced(tmp_path) -> None:
    filled(tmp_path / "at the end", 10)
    with journal(tmp_path / "often") as often:
        for step in steps(10):
            often.append(step)
            often.sync()
    assert content(tmp_path / "often") == content(tmp_path / "at the end")


@pytest.mark.parametrize("kept", [0, 1, 4, 6, 8, 9])
def test_a_journal_cut_back_goes_on_as_if_it_had_never_been_longer(tmp_path, kept: int) -> None:
    replay = tmp_path / "replay"
    with journal(replay) as one:
        for step in steps(10)[:kept]:
            one.append(step)
        segments = one.sync()
        for step in steps(3, seed=1):
            one.append(step)
        one.sync()
    with journal(replay, segments) as one:
        for step in steps(10)[kept:]:
            one.append(step)
        assert one.sync() == filled(tmp_path / "straight", 10)
        assert_same(list(one.last(10)), steps(10))
    assert content(replay) == content(tmp_path / "straight")


def test_steps_that_were_not_synced_are_not_there(tmp_path) -> None:
    with journal(tmp_path / "replay") as one:
        for step in steps(6):
            one.append(step)
    assert set(content(tmp_path / "replay").values()) == {b""}


def test_a_full_disk_loses_nothing(tmp_path) -> None:
    with journal(tmp_path / "replay") as one:
        for number, step in enumerate(steps(10)):
            one.append(step)
            if number in (2, 3, 6):
                with no_file_larger_than(SEGMENT // 2 + 5), pytest.raises(OSError, match="too large"):
                    one.sync()
        one.sync()
        assert_same(list(one.last(10)), steps(10))
    filled(tmp_path / "straight", 10)
    assert content(tmp_path / "replay") == content(tmp_path / "straight")


@pytest.mark.parametrize("name", ["000000.bin", "000001.bin", "000002.bin"])
@pytest.mark.parametrize("damage", ["missing", "cut off", "another byte"])
def test_a_damaged_segment_is_named_and_left_alone(tmp_path, name: str, damage: str) -> None:
    segments = filled(tmp_path, 10)
    path = tmp_path / name
    data = bytearray(path.read_bytes())
    data[7] ^= 1
    if damage == "missing":
        path.unlink()
    else:
        path.write_bytes(data if damage == "another byte" else data[:-1])
    before = content(tmp_path)
    with pytest.raises(JournalDamaged, match=str(path)):
        require_segments(tmp_path, segments)
    assert content(tmp_path) == before


def test_a_row_has_no_gaps() -> None:
    assert row_type(1, 111).itemsize == 4 * (111 + 3 + 111) + 8 + 2
