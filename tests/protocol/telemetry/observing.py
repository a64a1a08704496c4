"""A worker with a monitor of it, and a handler that takes its time."""

import threading
from contextlib import contextmanager

from protocol.messages import Role, SampleScene
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.serving import SCENES, serving
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.protocol.workers.scenes import scene_for


class Held:
    """A handler that tells when it has begun, and waits until it may end."""

    def __init__(self):
        self.begun = threading.Event()
        self.may_end = threading.Event()

    @property
    def handlers(self):
        return {SampleScene: self.sample}

    def sample(self, request):
        self.begun.set()
        self.may_end.wait(20)
        return scene_for(request.seed)


@contextmanager
def observed(address, handlers=SCENES, *, calls=None, **options):
    """A worker with telemetry; a monitor of it."""
    at = free_endpoint()
    about = About(role=Role.RENDER, name="render-0", serves=(address,), capabilities={"renderer": "opengl"})
    with (
        worker_telemetry(at, about, calls) as observer,
        serving(address, handlers, observer=observer, **options),
        monitoring(at) as monitor,
    ):
        yield monitor
