"""Behaves: answers with the scene whose yaw is the seed. A negative seed takes that many milliseconds first."""

import os
import sys
import time

from scenes import scene_for

from protocol import Timeouts, serve
from protocol.failpoint import failpoint_of
from protocol.messages import Role, Sampled, SampleScene
from protocol.system.logs import configure


def sample(request: SampleScene) -> Sampled:
    time.sleep(max(0, -request.seed) / 1000)
    return scene_for(request.seed)


configure("render")
serve(
    lambda: {SampleScene: sample},
    role=Role.RENDER,
    bind=sys.argv[1],
    timeouts=Timeouts(heartbeat=0.05),
    failpoint=failpoint_of(os.environ),
)
