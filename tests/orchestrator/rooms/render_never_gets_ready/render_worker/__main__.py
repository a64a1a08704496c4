import time

from stand_in import worker_options

from protocol import Handlers, serve
from protocol.messages import Role


def start_for_ever() -> Handlers:
    time.sleep(600)
    return {}


serve(start_for_ever, role=Role.RENDER, bind=worker_options().bind)
