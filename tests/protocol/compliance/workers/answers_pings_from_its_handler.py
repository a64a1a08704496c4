"""Pings wait in the queue, behind the work: one slow picture and the worker looks dead."""

import time

from proper_worker import Job, ProperWorker, run

from protocol.header import RequestHeader
from protocol.messages import Ping


class AnswersPingsFromItsHandler(ProperWorker):
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
