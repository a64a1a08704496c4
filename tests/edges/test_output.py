"""Output that can't be written: a full disk, a pipe that nobody reads, a stream that was closed before.

A new command gets its row by being listed in `PRINTS`.
"""

import json
import os
from pathlib import Path

import pytest

PRINTS = [
    ("--version",),
    ("--help",),
    ("status", "RUN"),
    ("status", "RUN", "--json"),
    ("resume", "RUN"),
    ("resume", "RUN", "--json"),
    ("keys", "new", "a", "--role", "render", "--dir", "KEYS"),
    ("models", "list"),
    ("models", "list", "--json"),
    ("calibration", "show"),
    ("lifter", "show"),
]
FULL = Path("/dev/full")
RICH_ENDS_IT = ("--help",)
"""Typer's own help ends without a word where its pipe is closed."""


@pytest.fixture
def full():
    if not FULL.exists():
        pytest.skip("not run: this machine has no /dev/full")
    with FULL.open("wb") as stream:
        yield stream


@pytest.fixture
def told(finished_run, tmp_path):
    names = {"RUN": str(finished_run.path), "KEYS": str(tmp_path / "keys")}
    return lambda arguments: [names.get(argument, argument) for argument in arguments]


def ends_in_a_sentence(done) -> bool:
    # Python itself warns of how a room's command is called.
    said = [line for line in done.stderr.splitlines() if b"RuntimeWarning" not in line]
    return done.returncode == 1 and b"Traceback" not in done.stderr and len(said) <= 1


@pytest.mark.slow
@pytest.mark.parametrize("arguments", PRINTS, ids=" ".join)
class TestStdout:
    def test_on_a_full_disk(self, command, told, arguments, full):
        done = command(*told(arguments), stdout=full)
        assert ends_in_a_sentence(done), done
        assert b"No space left on device" in done.stderr

    def test_into_a_pipe_that_nobody_reads(self, command, told, arguments):
        reading, writing = os.pipe()
        os.close(reading)
        done = command(*told(arguments), stdout=writing)
        os.close(writing)
        assert ends_in_a_sentence(done), done
        assert arguments == RICH_ENDS_IT or b"Broken pipe" in done.stderr

    def test_that_was_closed_before(self, command, told, arguments):
        done = command(*told(arguments), before=("sh", "-c", 'exec "$@" >&-', "sh"))
        assert ends_in_a_sentence(done), done
        assert b"Bad file descriptor" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [("status", "nowhere"), ("train", "nowhere"), ("train", "--no-such-option")])
def test_an_error_that_nobody_can_be_told_keeps_its_exit_code(command, told, arguments, full):
    expected = command(*arguments).returncode
    assert expected in (1, 2)
    assert command(*arguments, stderr=full).returncode == expected
    assert command(*arguments, before=("sh", "-c", 'exec "$@" 2>&-', "sh")).returncode == expected


@pytest.mark.slow
def test_the_three_streams_closed_take_no_file_of_ours_for_theirs(command, told):
    closed = ("sh", "-c", 'exec "$@" <&- >&- 2>&-', "sh")
    done = command(*told(("keys", "new", "a", "--role", "render", "--dir", "KEYS")), before=closed)
    keys = Path(*told(("KEYS",)))
    assert done.returncode == 1
    assert all(json.loads((keys / name).read_bytes()) for name in ("a.key", "allowed.json"))
