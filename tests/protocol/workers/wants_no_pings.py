"""Wants its first ping in three hundred years, the longest that can be said, and answers with a welcome to all."""

import msgspec
from bare_worker import open_worker, pong, welcome

from protocol.messages import Ping
from protocol.quantities import MOST_SECONDS

worker = open_worker()
while True:
    sender, number, message = worker.receive()
    never = msgspec.structs.replace(welcome(), heartbeat=MOST_SECONDS)
    worker.reply(sender, number, pong() if isinstance(message, Ping) else never)
