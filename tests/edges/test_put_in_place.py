"""Whatever is put in place is on the disk first: its bytes, and then its name."""

import ast
import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from agent.checkpointing.journal import write_record
from agent.checkpointing.weights import save_weights
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import collect_versions
from protocol.artifact import whole_directory, whole_file
from protocol.config import RunConfig
from protocol.failpoint import Failpoints
from protocol.messages import Role
from protocol.records import Summary
from protocol.security.allow_list import AllowList, write_allow_list
from protocol.security.key_pair import new_key_pair, write_key

CHECKOUT = Path(__file__).parents[2]
ROOMS = ("protocol", "render_worker", "perception_worker", "agent", "orchestrator")


@pytest.fixture
def synced(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The files and directories, by their numbers in the file system, that were seen through to the disk."""
    found: set[int] = set()
    fsync = os.fsync

    def noted(descriptor: int) -> None:
        found.add(os.fstat(descriptor).st_ino)
        fsync(descriptor)

    monkeypatch.setattr(os, "fsync", noted)
    return found


def make_run(folder: Path) -> Path:
    return RunDirectory.create(folder / "run", RunConfig(), collect_versions({})).path


def write_processes(folder: Path) -> Path:
    RunDirectory(folder).write_processes(())
    return folder / "workers.json"


def write_weights(folder: Path) -> Path:
    save_weights(folder / "weights.safetensors", {"a": np.zeros(2)}, {})
    return folder / "weights.safetensors"


def write_summary(folder: Path) -> Path:
    summary = Summary(
        steps=1, episodes=1, updates=1, seconds=1.0, steps_per_second=1.0, stages={}, late_replies=0, retries=0
    )
    write_record(folder / "summary.json", summary)
    return folder / "summary.json"


def write_allowed(folder: Path) -> Path:
    write_allow_list(AllowList(), folder / "allowed.json")
    return folder / "allowed.json"


def write_own_key(folder: Path) -> Path:
    write_key(new_key_pair("a", Role.RENDER), folder / "a.key")
    return folder / "a.key"


def write_order(folder: Path) -> Path:
    Failpoints(folder).order("place", "kill")
    return folder / "place"


WRITERS: tuple[Callable[[Path], Path], ...] = (
    make_run,
    write_processes,
    write_weights,
    write_summary,
    write_allowed,
    write_own_key,
    write_order,
)


@pytest.mark.parametrize("write", WRITERS, ids=lambda write: write.__name__)
def test_what_is_put_in_place_was_synced_and_so_was_its_name(tmp_path, synced, write):
    placed = write(tmp_path)
    everything = [placed, placed.parent, *(placed.rglob("*") if placed.is_dir() else ())]
    assert [path for path in everything if path.stat().st_ino not in synced] == []


def fail_in(placing: AbstractContextManager[Path], write: Callable[[Path], object]) -> None:
    with placing as aside:
        write(aside)
        raise ZeroDivisionError


def test_what_fails_on_its_way_leaves_what_was_there_and_nothing_aside(tmp_path):
    (tmp_path / "file").write_text("before")
    with pytest.raises(ZeroDivisionError):
        fail_in(whole_file(tmp_path / "file"), lambda aside: aside.write_text("half"))
    with pytest.raises(ZeroDivisionError):
        fail_in(whole_directory(tmp_path / "directory"), lambda aside: (aside / "one").write_text("half"))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("file", "before")]


def test_a_directory_that_has_anything_in_it_is_never_replaced(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "kept").touch()
    with pytest.raises(OSError, match="not empty"), whole_directory(tmp_path / "run"):
        pass
    assert [path.name for path in tmp_path.rglob("*")] == ["run", "kept"]


def test_nothing_else_renames_files():
    found = [f"{path.relative_to(CHECKOUT)}:{line}" for path in _sources() for line in _renames(path)]
    # An order is taken away, by one process alone; nothing is put in place.
    assert [place for place in found if not place.startswith(("protocol/artifact.py", "protocol/failpoint.py"))] == []


def _sources() -> Iterator[Path]:
    for room in ROOMS:
        yield from (CHECKOUT / room).rglob("*.py")


def _renames(path: Path) -> Iterator[int]:
    """Lines that call `rename`, or `replace` as paths have it: with one argument, where a string's has two."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
            continue
        to_one = node.func.attr == "replace" and len(node.args) == 1 and not node.keywords
        of_os = isinstance(node.func.value, ast.Name) and node.func.value.id in ("os", "shutil")
        if node.func.attr == "rename" or to_one or (of_os and node.func.attr in ("replace", "move", "link")):
            yield node.lineno
