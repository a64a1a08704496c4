"""Behaves, but for a start that takes ten minutes."""

import sys
import time

from protocol import Handlers, Timeouts, serve
from protocol.messages import Role
from protocol.system.logs import configure


def start() -> Handlers:
    time.sleep(600)
    return {}


configure("render")
serve(start, role=Role.RENDER, bind=sys.argv[1], timeouts=Timeouts(heartbeat=0.05))
