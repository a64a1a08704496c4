import time

from stand_in import run_worker

from protocol import Handlers
from protocol.messages import Role


def start_for_ever() -> Handlers:
    time.sleep(600)
    return {}


run_worker(Role.RENDER, start_for_ever)
