import subprocess
import sys

import psutil
import pytest

from orchestrator.run.process_record import ProcessRecord
from orchestrator.supervision.heartbeat import is_alive
from orchestrator.supervision.process_handle import AdoptedProcess, has_ended
from protocol.messages import Role

HEADLESS = """
import ctypes, threading, time
threading.Thread(target=time.sleep, args=(600,)).start()
ctypes.CDLL(None).pthread_exit(None)
"""


@pytest.fixture
def dying(wait_until):
    """A process in the state of one that was killed and whose other threads still have to get their turn to die."""
    child = subprocess.Popen([sys.executable, "-c", HEADLESS])
    process = psutil.Process(child.pid)
    wait_until(lambda: process.status() == psutil.STATUS_ZOMBIE)
    yield process
    child.kill()
    child.wait()


def test_a_process_whose_first_thread_alone_has_ended_runs_on(dying, wait_until):
    adopted = AdoptedProcess(dying)
    record = ProcessRecord(
        name="render-0", role=Role.RENDER, address=None, pid=dying.pid, started=dying.create_time(), log="logs/x.jsonl"
    )
    assert adopted.is_running
    assert not adopted.wait(0.05)
    assert is_alive(record)
    dying.kill()
    wait_until(lambda: has_ended(dying))
    assert not adopted.is_running
    assert adopted.wait(0.0)
    assert not is_alive(record)
