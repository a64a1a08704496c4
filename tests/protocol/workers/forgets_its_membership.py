"""Not a worker's process: it ends with its membership open, and the orchestrator was never there."""

import sys

from protocol.messages import Role, State, WorkerRecord
from protocol.server.membership import Membership

me = WorkerRecord(role=Role.AGENT, address="", incarnation="x", state=State.READY)
membership = Membership(sys.argv[1], describe=lambda: me, on_orphaned=lambda: None)
