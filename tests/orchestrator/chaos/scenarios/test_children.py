import os
import signal
import subprocess
import sys

import psutil
from msgspec.structs import replace

from orchestrator.chaos.scenarios.children import MARK, end, marked, send
from protocol.messages import Role


def test_those_who_run_are_told_from_those_who_ran(rehearsed, start):
    render, agent = start("render-0", Role.RENDER), start("agent", Role.AGENT)
    assert rehearsed.children.alive() == (render, agent)
    assert rehearsed.children.alive(Role.AGENT) == (agent,)
    os.kill(render.pid, signal.SIGKILL)
    rehearsed.wait(lambda: rehearsed.children.alive() == (agent,), "the death was seen")


def test_each_new_process_of_a_name_is_a_restart(rehearsed, start):
    start("agent", Role.AGENT)
    for _ in range(3):
        start("render-0", Role.RENDER)
        rehearsed.poll()
        rehearsed.poll()
    assert rehearsed.children.restarts == {"agent": 0, "render-0": 2}


def test_a_later_process_of_the_same_number_gets_no_signal(start):
    render = start("render-0", Role.RENDER)
    send(replace(render, started=render.started - 1.0), signal.SIGKILL)
    assert psutil.Process(render.pid).status() != psutil.STATUS_ZOMBIE


def test_processes_are_found_by_their_mark_and_ended_even_if_stopped():
    command = (sys.executable, "-c", "import time; time.sleep(600)")
    ours = subprocess.Popen(command, env=os.environ | {MARK: "a rehearsal"})
    other = subprocess.Popen(command, env=os.environ | {MARK: "another rehearsal"})
    try:
        ours.send_signal(signal.SIGSTOP)
        end(marked("a rehearsal"), patience=30.0)
        assert not psutil.pid_exists(ours.pid)
        assert other.poll() is None
    finally:
        other.kill()
        other.wait(30)
        ours.kill()
        ours.wait(30)
