"""Terminals that are narrow, dumb, unknown, absent, or closed while somebody works."""

import os
import pty
import struct
import subprocess
import sys
import termios
import threading
from fcntl import ioctl

import pytest
from rich.console import ConsoleDimensions

from orchestrator.terminal.console import can_be_redrawn

ROOMY = ConsoleDimensions(100, 40)
WORK = """
import sys, time
from orchestrator.monitoring.live_display import Snapshot
from orchestrator.cli.options import at_work
from protocol.system.streams import prepared_streams
with prepared_streams(), at_work() as (display, stop):
    for step in range(int(sys.argv[1])):
        display.show(Snapshot(activity=f"step {step}", elapsed=0.0, warning="render-0: it is dark"))
        time.sleep(0.02)
sys.stdout.write("all steps were done")
"""


@pytest.mark.parametrize("kind", ["xterm", "xterm-256color", "screen", "tmux-256color", "linux", "VT100"])
def test_a_terminal_that_moves_its_cursor_is_redrawn(kind):
    assert can_be_redrawn(kind, ROOMY)


@pytest.mark.parametrize("kind", ["dumb", "unknown", "", "printer", "xtermish"])
def test_any_other_is_not(kind):
    assert not can_be_redrawn(kind, ROOMY)


@pytest.mark.parametrize("size", [(20, 40), (59, 40), (100, 5), (1, 1)])
def test_nor_is_one_that_has_no_room_for_the_view(size):
    assert not can_be_redrawn("xterm", ConsoleDimensions(*size))


def shown_on_a_terminal(kind: str | None, size: tuple[int, int] = (40, 100)) -> tuple[bytes, bytes]:
    """What a person sees of work on a terminal (rows, columns), and what it says on stdout in the end."""
    master, slave = pty.openpty()
    ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("TERM", "COLUMNS", "LINES")}
    child = subprocess.Popen(
        [sys.executable, "-c", WORK, "3"],
        stdin=slave,
        stderr=slave,
        stdout=subprocess.PIPE,
        env=environment if kind is None else environment | {"TERM": kind},
    )
    os.close(slave)
    seen: list[bytes] = []
    reader = threading.Thread(target=_read_all, args=(master, seen))
    reader.start()
    said, _ = child.communicate(timeout=60)
    reader.join(60)
    os.close(master)
    return b"".join(seen), said


def _read_all(master: int, seen: list[bytes]) -> None:
    while True:
        try:
            seen.append(os.read(master, 65536))
        except OSError:
            return
        if not seen[-1]:
            return


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "size"),
    [("dumb", (40, 100)), ("unknown", (40, 100)), ("printer", (40, 100)), (None, (40, 100)), ("xterm", (40, 30))],
)
def test_where_nothing_can_be_redrawn_there_are_plain_lines_with_the_warnings(kind, size):
    seen, said = shown_on_a_terminal(kind, size)
    assert b"warning: render-0: it is dark" in seen
    assert b"step 0" in seen
    assert b"step 2" in seen
    assert b"\x1b" not in seen
    assert said == b"all steps were done"


@pytest.mark.slow
def test_a_roomy_terminal_is_redrawn():
    seen, said = shown_on_a_terminal("xterm-256color")
    assert b"\x1b" in seen
    assert b"last warning" in seen
    assert said == b"all steps were done"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["xterm", "dumb"])
def test_work_goes_on_when_its_terminal_is_closed(kind):
    master, slave = pty.openpty()
    child = subprocess.Popen(
        [sys.executable, "-c", WORK, "50"],
        stderr=slave,
        stdout=subprocess.PIPE,
        env=os.environ | {"TERM": kind, "COLUMNS": "100", "LINES": "40"},
    )
    os.close(slave)
    os.read(master, 1)
    os.close(master)
    said, _ = child.communicate(timeout=60)
    assert (child.returncode, said) == (0, b"all steps were done")


@pytest.mark.slow
def test_work_goes_on_when_nobody_reads_its_progress():
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-c", WORK, "3"], stderr=writing, stdout=subprocess.PIPE, check=False, timeout=60
    )
    os.close(writing)
    assert (done.returncode, done.stdout) == (0, b"all steps were done")


@pytest.mark.slow
def test_work_goes_on_without_any_terminal(tmp_path):
    closed = f'exec {sys.executable} -c "$0" 3 <&- 2>&- >{tmp_path}/said'
    done = subprocess.run(["sh", "-c", closed, WORK], check=False, timeout=60)
    assert (done.returncode, (tmp_path / "said").read_text()) == (0, "all steps were done")
