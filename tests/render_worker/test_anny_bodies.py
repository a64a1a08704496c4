"""The working cache; the body model itself is checked by every bake, against its own skinning."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from protocol.system.process_start import own_start
from render_worker.baking.anny_bodies import working_cache


@pytest.fixture
def empty_home(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    monkeypatch.delenv("ANNY_CACHE_DIR", raising=False)
    return tmp_path / "cache"


def test_the_working_cache_is_gone_afterwards(empty_home):
    with working_cache(empty_home):
        directory = Path(os.environ["ANNY_CACHE_DIR"])
        (directory / "large").write_bytes(b"x")
    assert list(empty_home.iterdir()) == []
    assert "ANNY_CACHE_DIR" not in os.environ


def test_it_is_gone_after_a_failure_too(empty_home):
    with pytest.raises(RuntimeError, match="no memory"), working_cache(empty_home):
        raise RuntimeError("no memory")
    assert list(empty_home.iterdir()) == []


def test_what_a_killed_bake_left_is_removed_and_what_another_uses_is_kept(empty_home):
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    us = own_start()
    assert us is not None
    used = empty_home / f".anny-{os.getpid()}-{us.ticks}-abc"
    earlier_of_our_number = empty_home / f".anny-{os.getpid()}-{us.ticks - 1}-abc"
    orphan = empty_home / f".anny-{gone.pid}-7-abc"
    for directory in (used, earlier_of_our_number, orphan):
        directory.mkdir(parents=True)
    with working_cache(empty_home):
        assert used.exists()
        assert not orphan.exists()
        assert not earlier_of_our_number.exists()


def test_a_cache_that_is_there_is_used(empty_home, tmp_path):
    (tmp_path / "home" / ".cache" / "anny").mkdir(parents=True)
    with working_cache(empty_home):
        assert "ANNY_CACHE_DIR" not in os.environ
    assert not empty_home.exists()
