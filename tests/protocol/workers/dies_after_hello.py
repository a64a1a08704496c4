"""Says welcome, is ready, and is gone with the first request."""

import os
import signal

from bare_worker import open_worker

open_worker().serve(lambda worker, sender, number, message: os.kill(os.getpid(), signal.SIGKILL))
