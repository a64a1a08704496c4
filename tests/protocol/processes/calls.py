"""Clients and requests as the tests of the transport use them."""

from typing import Any

from protocol import Client, Timeouts
from protocol.messages import Role, SampleScene

PATIENT = Timeouts(call=20.0, startup=20.0, heartbeat=0.05)
"""Long enough for a busy machine; what is to fail is given a deadline of its own."""


def ask(seed: int) -> SampleScene:
    """A request that `workers/scenes.py` answers with a scene whose yaw is the seed."""
    return SampleScene(seed=seed, split="train")


def client_of(address: str, timeouts: Timeouts = PATIENT, **options: Any) -> Client:
    """An agent's client."""
    return Client(address, role=Role.AGENT, timeouts=timeouts, **options)
