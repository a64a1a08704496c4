import sys
from io import StringIO
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from rich.console import Console

from orchestrator.doctor import Check, all_needed_passed, checks_table
from orchestrator.doctor.machine import LEAST_MEMORY, check_memory, check_python, check_sockets
from orchestrator.doctor.packages import check_packages
from orchestrator.doctor.rooms import probe

DECLARED = (
    Requirement("msgspec>=0.18"),
    Requirement("numpy>=999; extra == 'render'"),
    Requirement("no-such-package-at-all>=1; extra == 'agent'"),
)


def test_an_old_python_is_told_what_to_install():
    assert check_python((3, 11, 0)).passed
    old = check_python((3, 10, 4))
    assert not old.passed
    assert "3.11" in old.remedy


def test_too_little_memory_fails_and_enough_passes():
    assert check_memory(LEAST_MEMORY).passed
    assert not check_memory(LEAST_MEMORY - 1).passed


def test_a_package_that_is_missing_or_too_old_is_named_with_how_to_install_it():
    missing = check_packages("agent", DECLARED)
    assert not missing.passed
    assert "no-such-package-at-all>=1" in missing.found
    assert "vantage[agent]" in missing.remedy
    old = check_packages("render", DECLARED)
    assert not old.passed
    assert "numpy>=999" in old.found


def test_packages_of_other_rooms_do_not_count():
    assert check_packages("perception", DECLARED).passed


def test_without_metadata_nothing_is_installed():
    assert "not installed" in check_packages("render", ()).found


def test_sockets_work_here():
    assert check_sockets().passed


@pytest.mark.parametrize(
    ("code", "passed", "found"),
    [
        ("print('llvmpipe')", True, "llvmpipe"),
        ("raise SystemExit('no EGL')", False, "no EGL"),
        ("raise FileNotFoundError('bodies are missing')", False, "bodies are missing"),
        ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", False, "was killed by SIGKILL"),
        ("pass", True, "no output"),
    ],
)
def test_a_probe_passes_by_its_exit_code_and_tells_its_last_line(code, passed, found):
    check = probe("OpenGL", (sys.executable, "-c", code), remedy="install it")
    assert (check.passed, check.found.removeprefix("FileNotFoundError: ")) == (passed, found)
    assert check.remedy == ("" if passed else "install it")


def test_a_probe_that_is_not_there_fails():
    assert not probe("OpenGL", (str(Path("/no/such/program")),), remedy="install it").passed


def test_only_what_is_needed_decides():
    slow = Check(name="cores", passed=False, needed=False, found="1", remedy="more cores help")
    broken = Check(name="bodies", passed=False, found="missing", remedy="orchestrator bodies bake")
    assert all_needed_passed([slow])
    assert not all_needed_passed([slow, broken])


def test_the_list_says_what_to_do_under_each_failed_line():
    broken = Check(name="bodies", passed=False, found="[missing]", remedy="orchestrator bodies bake")
    console = Console(width=100, record=True, file=StringIO())
    console.print(checks_table([Check(name="Python", passed=True, found="3.11"), broken]))
    lines = [line.strip() for line in console.export_text().splitlines()]
    assert lines[1].split() == ["FAILED", "bodies", "[missing]"]
    assert lines[2] == "→ orchestrator bodies bake"
