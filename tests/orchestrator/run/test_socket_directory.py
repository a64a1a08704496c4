import stat
import tempfile

import pytest

from orchestrator.errors import RunError
from orchestrator.run.socket_directory import LONGEST_NAMES, run_sockets, socket_directory, sockets_of
from protocol.transport.address import LONGEST_IPC_PATH


def test_only_we_may_enter_and_nothing_is_left():
    with socket_directory() as sockets:
        assert stat.S_IMODE(sockets.stat().st_mode) == 0o700
        (sockets / "render-0").touch()
    assert not sockets.exists()


@pytest.mark.parametrize("length", [60, 120, 200])
def test_a_socket_fits_however_long_the_temporary_directory_is(tmp_path, monkeypatch, length):
    parent = tmp_path
    while len(str(parent)) < length:
        parent /= "deep"
    parent.mkdir(parents=True, exist_ok=True)
    monkeypatch.setattr(tempfile, "tempdir", str(parent))
    with socket_directory() as sockets:
        assert len(str(sockets / "perception-1000")) <= LONGEST_IPC_PATH
        assert len(sockets.name) + len("/perception-1000/") <= LONGEST_NAMES
    assert len(sockets_of(tmp_path).name) + len("/perception-1000/") <= LONGEST_NAMES


def test_a_runs_sockets_are_where_they_were_for_whoever_comes_next(tmp_path):
    with run_sockets(tmp_path / "run") as first:
        assert stat.S_IMODE(first.stat().st_mode) == 0o700
        (first / "render-0").touch()
        with run_sockets(tmp_path / "elsewhere" / ".." / "run") as second:
            assert second == first
            assert (second / "render-0").exists()
    assert not first.exists()


def test_two_runs_share_no_directory(tmp_path):
    assert sockets_of(tmp_path / "one") != sockets_of(tmp_path / "two")


def test_a_directory_that_others_may_enter_is_refused_and_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = sockets_of(tmp_path / "run")
    path.mkdir(mode=0o755)
    with pytest.raises(RunError, match="other users may enter"), run_sockets(tmp_path / "run"):
        pass
    assert path.exists()


def test_a_link_that_somebody_put_there_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    sockets_of(tmp_path / "run").symlink_to(elsewhere)
    with pytest.raises(RunError, match="belongs to another user"), run_sockets(tmp_path / "run"):
        pass
