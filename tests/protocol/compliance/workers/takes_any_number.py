"""A queue without an end: every client waits for all the others."""

from proper_worker import ProperWorker, run


class TakesAnyNumber(ProperWorker):
    def queue(self, job) -> None:
        if self.drainers:
            super().queue(job)
        else:
            self.in_hand += 1
            self.jobs.put(job)


run(TakesAnyNumber)
