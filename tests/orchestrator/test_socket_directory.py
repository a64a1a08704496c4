import stat
import tempfile

import pytest

from orchestrator.socket_directory import LONGEST_NAMES, socket_directory
from protocol.address import LONGEST_IPC_PATH


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
