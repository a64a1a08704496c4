"""An orchestrator's registry as a program: `registry.py ADDRESS KEY`."""

import os
import sys
from pathlib import Path

from orchestrator.registry import Registry
from protocol import logs, serve
from protocol.messages import Role
from protocol.security import Security, load_credentials

logs.configure(Role.ORCHESTRATOR)
security = Security(load_credentials(Path(sys.argv[2])))
serve(Registry(5.0).handlers, role=Role.ORCHESTRATOR, bind=sys.argv[1], computes=False, security=security)
sys.stdout.flush()
os._exit(0)
