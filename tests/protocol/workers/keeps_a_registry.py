"""Not a worker but an orchestrator's table, in a process that can be killed and stopped."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

from protocol import Timeouts, serve
from protocol.messages import Role
from protocol.system.logs import configure
from tests.protocol.processes.registry import Registry

configure("orchestrator")
serve(Registry().handlers, role=Role.ORCHESTRATOR, bind=sys.argv[1], timeouts=Timeouts(heartbeat=0.05))
