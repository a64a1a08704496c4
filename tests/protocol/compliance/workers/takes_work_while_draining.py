"""Begins new work after it was told to end."""

from proper_worker import Job, ProperWorker, run


class TakesWorkWhileDraining(ProperWorker):
    def queue(self, job: Job) -> None:
        drainers, self.drainers = self.drainers, []
        super().queue(job)
        self.drainers = drainers


run(TakesWorkWhileDraining)
