"""docs/protocol.md says what is so: its numbers, its defaults, its worker."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from protocol import Limits
from protocol.array_part import ELEMENT_TYPES
from protocol.catalogue import reply_type
from protocol.errors import Rejected
from protocol.message import Request
from protocol.messages import MESSAGE_NUMBERS, Render, Role, WorkerRecord
from protocol.system.exit_code import ExitCode
from protocol.timeouts import DEFAULT_TIMEOUTS
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.values.samples import CAMERA, SCENE

PAGE = (Path(__file__).parents[2] / "docs" / "protocol.md").read_text()


def test_the_page_lists_every_message_with_its_number_and_reply():
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (?:`(\w+)`)? ?\|", PAGE, re.MULTILINE)
    replies = {kind: reply_type(kind).__name__ if issubclass(kind, Request) else "" for kind in MESSAGE_NUMBERS}
    assert rows == [(str(number), kind.__name__, replies[kind]) for kind, number in MESSAGE_NUMBERS.items()]


def test_the_page_lists_every_field():
    rows = dict(re.findall(r"^\| \d+ \| `(\w+)` \|[^|]*\| ([^|]*) \|", PAGE, re.MULTILINE))
    for kind in MESSAGE_NUMBERS:
        named = re.sub(r"\[\{.*\}\]", "", rows[kind.__name__])
        assert set(re.findall(r"`(\w+)`", named)) == set(kind.__struct_fields__)


def test_the_page_lists_every_element_type():
    assert f"one of {', '.join(f'`{name}`' for name in ELEMENT_TYPES)};" in PAGE.replace("`dtype` is ", "")


def test_the_page_lists_every_limit():
    assert all(f"`{name}`" in PAGE for name in Limits.__struct_fields__)


def test_the_page_lists_every_field_of_a_worker_s_record():
    (listed,) = re.findall(r"`workers` \[\{(.*?)\}\]", PAGE)
    assert re.findall(r"`(\w+)`", listed) == list(WorkerRecord.__struct_fields__)


def test_the_page_has_the_clocks_defaults():
    clocks = re.findall(r"^\| \w+, `timeouts\.(\w+)`, (\d+) s \|", PAGE, re.MULTILINE)
    assert clocks == [(name, f"{getattr(DEFAULT_TIMEOUTS, name):g}") for name in ("startup", "liveness", "progress")]


def test_the_page_lists_every_exit_code():
    section = PAGE.partition("## How a process ends")[2].partition("\n## ")[0]
    assert re.findall(r"^\| (\d) \|", section, re.MULTILINE) == [str(int(code)) for code in ExitCode]


@pytest.mark.slow
def test_the_page_s_worker_works(address):
    (program,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "router.bind" in block)
    worker = subprocess.Popen([sys.executable, "-c", program.replace("tcp://127.0.0.1:5555", address)])
    try:
        with client_of(address, serves=Role.RENDER) as client:
            client.wait_ready()
            assert client.call(Render(scene=SCENE, camera=CAMERA)).depth.shape == (6, 8)
            with pytest.raises(Rejected, match="only Render is served here"):
                client.call(ask(1))
    finally:
        worker.kill()
        worker.wait()
