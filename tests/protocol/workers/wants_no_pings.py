"""Wants a heartbeat in all eternity, and answers whatever is asked with a welcome."""

import math

import msgspec
from bare_worker import open_worker, pong, welcome

from protocol.messages import Ping

worker = open_worker()
while True:
    sender, number, message = worker.receive()
    never = msgspec.structs.replace(welcome(), heartbeat=math.inf)
    worker.reply(sender, number, pong() if isinstance(message, Ping) else never)
