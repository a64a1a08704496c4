"""What edges are tried on: real commands, with stand-ins for the rooms whose processes they start."""

from tests.orchestrator.conftest import Command, orchestrator, wait_until

__all__ = ["Command", "orchestrator", "wait_until"]
