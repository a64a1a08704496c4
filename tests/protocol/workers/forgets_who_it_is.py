"""Has another incarnation in every reply."""

import itertools

from bare_worker import open_worker, pong, welcome
from scenes import scene_for

from protocol.messages import Hello, Ping

worker = open_worker()
for count in itertools.count():
    sender, number, message = worker.receive()
    reply = (
        welcome() if isinstance(message, Hello) else pong() if isinstance(message, Ping) else scene_for(message.seed)
    )
    worker.reply(sender, number, reply, incarnation=f"life {count}")
