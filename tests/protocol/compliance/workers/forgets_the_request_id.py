"""Has one place for the request that is under way: each reply has the id of the one that came last."""

from proper_worker import ProperWorker, run


class ForgetsTheRequestId(ProperWorker):
    latest = 0

    def queue(self, job) -> None:
        self.latest = job.number
        super().queue(job)

    def handle_all(self) -> None:
        while True:
            job = self.jobs.get()
            reply = self.refuse_late(job) or self.compute(job.request)
            self.handler.send_multipart([job.sender, *self.sealed(self.latest, reply)])


run(ForgetsTheRequestId)
