"""Says welcome and is gone."""

import os
import signal

from bare_worker import open_worker, welcome

worker = open_worker()
sender, number, _ = worker.receive()
worker.reply(sender, number, welcome())
worker.receive()
os.kill(os.getpid(), signal.SIGKILL)
