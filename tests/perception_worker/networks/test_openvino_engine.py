"""OpenVINO in a process that has just started."""

import subprocess
import sys

import pytest

_TWO_FIRST_FRAMES = """
import threading
import numpy as np
from perception_worker.networks.backend import open_network
from protocol.config import PerceptionConfig

network = open_network(PerceptionConfig(backend="openvino"))
together = threading.Barrier(2)

def first_frame():
    together.wait()
    network.infer(np.zeros((480, 640, 3), np.uint8))

threads = [threading.Thread(target=first_frame, daemon=True) for _ in range(2)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
"""


@pytest.mark.slow
@pytest.mark.parametrize("start", range(6))
def test_two_first_frames_at_once_are_both_inferred(start: int):
    """Without an inference at its opening the network stood still for ever in a third of all starts."""
    subprocess.run([sys.executable, "-c", _TWO_FIRST_FRAMES], check=True, timeout=60)
