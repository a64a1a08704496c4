"""Takes the connection and says nothing at all."""

from bare_worker import open_worker

worker = open_worker()
while True:
    worker.receive()
