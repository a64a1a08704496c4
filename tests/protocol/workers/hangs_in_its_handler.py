"""Answers every ping, and is caught in its handler for ever with the first request."""

import sys
import threading

from protocol import Timeouts, serve
from protocol.messages import Role, SampleScene
from protocol.system.logs import configure


def hang(request: SampleScene):
    threading.Event().wait()


configure("render")
serve(lambda: {SampleScene: hang}, role=Role.RENDER, bind=sys.argv[1], timeouts=Timeouts(heartbeat=0.05))
