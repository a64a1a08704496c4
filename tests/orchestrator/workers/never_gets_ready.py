"""Answers pings and starts for ever."""

import sys
import time

from protocol import serve
from protocol.messages import Role
from protocol.system.logs import configure

configure("render")


def start_for_ever():
    time.sleep(600)
    return {}


serve(start_for_ever, role=Role.RENDER, bind=sys.argv[1])
