import os
import subprocess
import sys
import time

import pytest

from protocol.system.process_start import ProcessStart, own_start, process_start

BOOT = "b015696d-0a95-4c4c-932f-b7641a63e976"


@pytest.fixture
def proc(tmp_path):
    """What a system tells of a process with a name that is hard to read, number 7."""
    (tmp_path / "sys/kernel/random").mkdir(parents=True)
    (tmp_path / "sys/kernel/random/boot_id").write_text(f"{BOOT}\n")
    (tmp_path / "7").mkdir()
    (tmp_path / "7/stat").write_bytes(b"7 (a) b \xff (c) S " + b" ".join(b"%d" % field for field in range(4, 53)))
    return tmp_path


def test_a_process_is_known_by_the_boot_and_the_ticks_since(proc):
    assert process_start(7, proc) == ProcessStart(BOOT, 22)


def test_it_is_the_same_for_whoever_asks_and_whenever():
    told = subprocess.run(
        [sys.executable, "-c", "import os; from protocol.system.process_start import process_start; "
         "print(process_start(os.getppid()).ticks)"],
        capture_output=True,
        check=True,
    )  # fmt: skip
    ours = own_start()
    assert ours is not None
    assert int(told.stdout) == ours.ticks
    assert process_start(os.getpid()) == ours


def test_who_is_gone_has_none():
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert process_start(child.pid) is None


def test_its_age_is_no_matter_of_the_wall_clock(monkeypatch):
    ours = own_start()
    assert ours is not None
    monkeypatch.setattr(time, "time", lambda: 0.0)
    assert 0.0 < ours.age < 86400.0


def test_without_a_proc_the_system_is_asked_otherwise(tmp_path):
    ours = process_start(os.getpid(), tmp_path)
    assert ours is not None
    assert ours.boot == ""
    assert ours == process_start(os.getpid(), tmp_path)
    assert 0.0 <= ours.age < 86400.0
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert process_start(child.pid, tmp_path) is None
