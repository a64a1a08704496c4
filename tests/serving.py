"""Workers in threads of the test's own process."""

import threading
from contextlib import contextmanager

from protocol.client.client import Client
from protocol.messages import Drain, Role
from protocol.server.server import serve


@contextmanager
def serving(handlers, address, *, role, **options):
    """A worker in a thread."""
    thread = threading.Thread(target=serve, args=(lambda: handlers,), kwargs={"role": role, "bind": address, **options})
    thread.start()
    try:
        yield
    finally:
        with Client(address, role=Role.AGENT) as client:
            client.call(Drain())
        thread.join()
