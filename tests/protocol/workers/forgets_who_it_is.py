"""Changes its incarnation after every request, as if it had been restarted."""

from bare_worker import open_worker, pong, welcome

from protocol.messages import Hello, Ping

worker = open_worker()
lives = 0
while True:
    sender, number, message = worker.receive()
    if isinstance(message, Hello | Ping):
        reply = welcome() if isinstance(message, Hello) else pong()
        worker.reply(sender, number, reply, incarnation=f"life {lives}")
    else:
        lives += 1
