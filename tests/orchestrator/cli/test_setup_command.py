import os
import signal
import sys
import threading

import pytest

from orchestrator.cli import setup_command
from orchestrator.cli.setup_command import run_setup
from protocol.errors import Interrupted
from protocol.system.stop_request import StopRequest, stop_on_signals


@pytest.fixture
def module(monkeypatch):
    """Has the set-up command be a few lines of Python."""

    def use(code: str) -> None:
        monkeypatch.setattr(
            setup_command, "module_command", lambda module, *arguments: (sys.executable, "-c", code, *arguments)
        )

    return use


def test_the_exit_code_and_the_words_are_the_commands_own(module, capfd):
    module("import sys; print(sys.argv[1]); sys.stderr.write('half done'); sys.exit(3)")
    assert run_setup("room.bake", "--force", stop=StopRequest()) == 3
    assert capfd.readouterr() == ("--force\n", "half done")


def test_a_request_to_stop_lets_the_command_clean_up(module, tmp_path):
    working, cleaned = tmp_path / "working", tmp_path / "cleaned"
    module(
        "import pathlib, signal, sys, time\n"
        f"def end(*_): pathlib.Path({str(cleaned)!r}).touch(); sys.exit(143)\n"
        f"signal.signal(signal.SIGTERM, end); pathlib.Path({str(working)!r}).touch(); time.sleep(600)"
    )
    with stop_on_signals() as stop:
        interrupt_when(working.exists)
        with pytest.raises(Interrupted, match="was stopped on request"):
            run_setup("room.bake", stop=stop)
    assert cleaned.exists()


def interrupt_when(condition) -> None:
    def watch() -> None:
        while not condition():
            threading.Event().wait(0.02)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=watch, daemon=True).start()
