import os
from pathlib import Path

import pytest

from orchestrator.run.run_log import KEPT, log_directory


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))
    return tmp_path / "logs"


def aged(path: Path, seconds: float) -> Path:
    path.mkdir()
    made = path.stat().st_mtime - seconds
    os.utime(path, (made, made))
    return path


def test_two_commands_have_logs_of_their_own(logs: Path) -> None:
    one, other = log_directory(), log_directory()
    assert one != other
    assert {one.parent, other.parent} == {logs}


def test_old_logs_are_removed_and_nothing_else(logs: Path) -> None:
    recent = log_directory()
    old = aged(logs / "20260101-000000-x", KEPT + 60.0)
    month = aged(logs / "20260201-000000-x", KEPT - 60.0)
    # Where the configuration of a command of an older version is, which may still work.
    others = aged(logs / ".workers-x", 2 * KEPT)
    newest = log_directory()
    assert set(logs.iterdir()) == {recent, month, others, newest}
    assert not old.exists()
