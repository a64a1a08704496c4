"""A worker in a thread of this process, for as long as a `with` lasts."""

import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any

from protocol import Client, Handlers, Timeouts, serve
from protocol.messages import Drain, Role, SampleScene
from tests.protocol.workers.scenes import scene_for

SCENES: Handlers = {SampleScene: lambda request: scene_for(request.seed)}


@contextmanager
def serving(address: str, handlers: Handlers | Callable[[], Handlers] = SCENES, **options: Any) -> Generator[None]:
    """Serve `handlers`, or what a function returns once it has loaded them, and drain at the end."""
    load = handlers if callable(handlers) else lambda: handlers
    thread = threading.Thread(
        target=serve, args=(load,), kwargs={"role": Role.RENDER, "bind": address, **options}, daemon=True
    )
    thread.start()
    with Client(address, role=Role.ORCHESTRATOR, timeouts=Timeouts(call=20)) as client:
        client.ping()
        try:
            yield
        finally:
            client.call(Drain())
            thread.join()
