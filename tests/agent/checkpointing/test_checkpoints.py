from pathlib import Path

import msgspec
import numpy as np
import pytest

from agent.checkpointing.append_only_file import mark_of_bytes
from agent.checkpointing.checkpoint import Content, Grown, Manifest, read_checkpoint
from agent.checkpointing.checkpoints import Checkpoints
from protocol.config import RunConfig, TrainingConfig
from protocol.errors import ArtifactDamaged, ArtifactMissing
from tests.agent.checkpointing.full_disk import no_file_larger_than

CONFIG = RunConfig(training=TrainingConfig(keep_checkpoints=2))
GROWN = Grown(episodes=mark_of_bytes(b""))


def content(step: int, mean_return: float | None = None) -> Content:
    return Content(
        step=step,
        mean_return=mean_return,
        weights={"policy.bias": np.full(3, step, np.float32)},
        about={"steps": str(step)},
        state={"step": step, "noise": np.arange(4)},
        measured={"seconds": 1.5},
    )


@pytest.fixture
def checkpoints(tmp_path: Path) -> Checkpoints:
    return Checkpoints(tmp_path / "checkpoints", CONFIG)


def names(tmp_path: Path) -> list[str]:
    return sorted(path.name for path in (tmp_path / "checkpoints").iterdir())


def test_where_there_are_none_there_is_no_newest(checkpoints) -> None:
    assert checkpoints.newest() is None


def test_the_newest_has_all_that_was_kept(checkpoints) -> None:
    for step in (500, 1000):
        checkpoints.write(content(step, -9.5), lambda: GROWN)
    newest = checkpoints.newest()
    assert newest is not None
    assert (newest.path.name, newest.manifest.step, newest.manifest.mean_return) == ("step-000001000", 1000, -9.5)
    assert newest.weights()["policy.bias"].tolist() == [1000.0] * 3
    assert newest.state()["step"] == 1000
    assert newest.state()["noise"].tolist() == [0, 1, 2, 3]
    assert newest.measured() == {"seconds": 1.5}
    assert newest.manifest.grown == GROWN


def test_the_last_ones_stay_and_the_best(tmp_path, checkpoints) -> None:
    for step, mean_return in [(1, None), (2, -30.0), (3, -10.0), (4, -20.0), (5, None), (6, -15.0)]:
        checkpoints.write(content(step, mean_return), lambda: GROWN)
    assert names(tmp_path) == ["step-000000003", "step-000000005", "step-000000006"]


def test_of_equally_good_ones_the_newest_stays(tmp_path, checkpoints) -> None:
    for step in range(1, 6):
        checkpoints.write(content(step, -10.0 if step < 3 else -20.0), lambda: GROWN)
    assert names(tmp_path) == ["step-000000002", "step-000000004", "step-000000005"]


def test_steps_past_nine_digits_are_still_in_order(checkpoints) -> None:
    for step in (999_999_999, 1_000_000_000):
        checkpoints.write(content(step), lambda: GROWN)
    newest = checkpoints.newest()
    assert newest is not None
    assert newest.manifest.step == 1_000_000_000


def test_what_was_left_aside_goes_and_so_do_damaged_ones_after_the_newest_whole_one(tmp_path, checkpoints) -> None:
    for step in (1, 2):
        checkpoints.write(content(step), lambda: GROWN)
    (tmp_path / "checkpoints" / "step-000000002" / "state.msgpack").write_bytes(b"")
    (tmp_path / "checkpoints" / ".step-000000003.0123").mkdir()
    (tmp_path / "checkpoints" / "notes").mkdir()
    checkpoints.tidy(checkpoints.newest())
    assert names(tmp_path) == ["notes", "step-000000001"]


@pytest.mark.parametrize("room", [0, 100, 400])
def test_without_room_all_is_as_before(tmp_path, checkpoints, room: int) -> None:
    checkpoints.write(content(1), lambda: GROWN)
    with no_file_larger_than(room), pytest.raises(OSError, match="too large"):
        checkpoints.write(content(2), lambda: GROWN)
    assert names(tmp_path) == ["step-000000001"]
    checkpoints.write(content(2), lambda: GROWN)
    assert names(tmp_path) == ["step-000000001", "step-000000002"]


def test_places_are_reached_in_order(tmp_path) -> None:
    reached: list[str] = []
    Checkpoints(tmp_path / "checkpoints", CONFIG, reached.append).write(content(1), lambda: GROWN)
    assert [place.removeprefix("checkpoint-") for place in reached] == [
        "opened",
        "journal-synced",
        "written",
        "manifest-written",
        "renamed",
        "pruned",
    ]


@pytest.mark.parametrize("name", ["weights.safetensors", "state.safetensors", "state.msgpack", "measured.msgpack"])
@pytest.mark.parametrize("keep", [None, 0, -1])
def test_a_file_that_is_missing_or_cut_off_is_named(tmp_path, checkpoints, name: str, keep: int | None) -> None:
    checkpoints.write(content(1), lambda: GROWN)
    directory = tmp_path / "checkpoints" / "step-000000001"
    data = (directory / name).read_bytes()
    (directory / name).unlink() if keep is None else (directory / name).write_bytes(data[:keep])
    with pytest.raises(ArtifactMissing if keep is None else ArtifactDamaged, match=name):
        read_checkpoint(directory)


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b'{"format": 1}', b'{"format": "one"}', b"\xff"])
def test_a_manifest_that_can_not_be_read_is_damage(tmp_path, checkpoints, text: bytes) -> None:
    checkpoints.write(content(1), lambda: GROWN)
    (tmp_path / "checkpoints" / "step-000000001" / "manifest.json").write_bytes(text)
    with pytest.raises(ArtifactDamaged, match=r"manifest\.json"):
        read_checkpoint(tmp_path / "checkpoints" / "step-000000001")


def test_a_field_that_came_later_in_the_same_format_does_no_harm(tmp_path, checkpoints) -> None:
    checkpoints.write(content(1), lambda: GROWN)
    path = tmp_path / "checkpoints" / "step-000000001" / "manifest.json"
    manifest = msgspec.json.decode(path.read_bytes())
    path.write_bytes(msgspec.json.encode({**manifest, "wind": 3}))
    assert read_checkpoint(path.parent).manifest == msgspec.convert(manifest, Manifest)
