"""Wants a heartbeat in all eternity, and answers whatever is asked with a welcome."""

import math

import msgspec
from bare_worker import open_worker, welcome

worker = open_worker()
while True:
    sender, number, _ = worker.receive()
    worker.reply(sender, number, msgspec.structs.replace(welcome(), heartbeat=math.inf))
