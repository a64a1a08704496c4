"""Registers, and is soon an orphan: `python joins_an_orchestrator.py ADDRESS ORCHESTRATOR [starts for ever|hangs]`."""

import sys
import threading

from scenes import scene_for

from protocol import Handlers, Timeouts, serve
from protocol.messages import Role, Sampled, SampleScene
from protocol.server.registration_settings import RegistrationSettings
from protocol.system.logs import configure

_, address, orchestrator, *sins = sys.argv


def start() -> Handlers:
    if "starts for ever" in sins:
        threading.Event().wait()
    return {SampleScene: sample}


def sample(request: SampleScene) -> Sampled:
    if "hangs" in sins:
        threading.Event().wait()
    return scene_for(request.seed)


configure("render")
serve(
    start,
    role=Role.RENDER,
    bind=address,
    timeouts=Timeouts(call=1.0, heartbeat=0.05, liveness=0.5, grace=2.0),
    registration=RegistrationSettings(orchestrator, "render-0"),
)
