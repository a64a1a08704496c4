"""Welcomes everyone to version 9, as a worker from the future would that reads no version ranges."""

from bare_worker import open_worker, welcome

worker = open_worker()
while True:
    sender, number, _ = worker.receive()
    worker.reply(sender, number, welcome(version=9))
