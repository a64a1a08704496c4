"""Answers pings, and never a request."""

import sys
import time

from protocol import serve
from protocol.messages import Role, Sampled, SampleScene


def hang(_request: SampleScene) -> Sampled:
    while True:
        time.sleep(600)


serve(lambda: {SampleScene: hang}, role=Role.RENDER, bind=sys.argv[1])
