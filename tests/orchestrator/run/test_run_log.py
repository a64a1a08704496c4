from pathlib import Path

import pytest

from orchestrator.run.run_log import KEPT, log_directory


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
    return tmp_path / "logs"


def test_two_commands_have_logs_of_their_own(logs: Path) -> None:
    one, other = log_directory(), log_directory()
    assert one != other
    assert {one.parent, other.parent} == {logs}


def test_the_newest_logs_are_kept(logs: Path) -> None:
    made = [log_directory() for _ in range(KEPT)]
    old = logs / "20260101-000000-x"
    old.mkdir()
    (old / "render-0.jsonl").write_text("{}\n")
    newest = log_directory()
    left = set(logs.iterdir())
    assert newest in left
    assert old not in left
    assert len(left) == KEPT
    assert len(set(made) & left) == KEPT - 1
