"""A room's own set-up command, run as a process so that the orchestrator needs nothing of what the room needs."""

import subprocess

from orchestrator.supervision.launch import module_command
from protocol.errors import Interrupted
from protocol.system.stop_request import StopRequest

STOP_PATIENCE = 10.0
"""Seconds to clean up working files."""
POLL = 0.2


def run_setup(module: str, *arguments: str, stop: StopRequest) -> int:
    """Run `python -m MODULE ARGUMENTS…`, its words going where ours go, and return its exit code.

    Raises:
        Interrupted: somebody asked to stop; the command has cleaned up behind itself.
    """
    # A process group of its own: Ctrl-C reaches us alone, and we let the command clean up.
    with subprocess.Popen(module_command(module, *arguments), stdin=subprocess.DEVNULL, process_group=0) as command:
        try:
            while command.poll() is None and not stop.is_asked:
                stop.sleep(POLL, until=lambda: command.poll() is not None)
        finally:
            _end(command)
    if stop.is_asked:
        raise Interrupted(f"{module} was stopped on request")
    return command.returncode


def _end(command: subprocess.Popen[bytes]) -> None:
    if command.poll() is not None:
        return
    command.terminate()
    try:
        command.wait(STOP_PATIENCE)
    except subprocess.TimeoutExpired:
        command.kill()
