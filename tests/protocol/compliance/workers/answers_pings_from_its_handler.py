"""Pings wait in the queue, behind the work: one slow picture and the worker looks dead."""

import time

from proper_worker import Job, ProperWorker, run

from protocol.header import RequestHeader
from protocol.messages import Ping

_PINGS_AT_ONCE = 8
"""At most: an answered ping lowers the progress by one until its reply is sent, and that must not get negative."""


class AnswersPingsFromItsHandler(ProperWorker):
    def __init__(self, address: str) -> None:
        super().__init__(address)
        self.progress = _PINGS_AT_ONCE

    def answer(self, sender, header: RequestHeader, message) -> None:
        if isinstance(message, Ping):
            # Not counted as work, here and below, so that its counters are right.
            self.jobs.put(Job(sender, header.request, message, time.monotonic() + header.deadline))
            self.in_hand += 1
        else:
            super().answer(sender, header, message)

    def compute(self, request):
        if isinstance(request, Ping):
            self.in_hand -= 1
            pong = self.health()
            self.in_hand += 1
            self.progress -= 1
            return pong
        return super().compute(request)


run(AnswersPingsFromItsHandler)
