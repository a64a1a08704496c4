"""Ends with its registration open; no orchestrator ever answered it."""

import sys

from protocol.messages import Role, State, WorkerRecord
from protocol.server.registration import Registration

me = WorkerRecord(role=Role.AGENT, address="", incarnation="x", state=State.READY)
registration = Registration(sys.argv[1], describe=lambda: me, on_orphaned=lambda: None)
