"""Computes for those who have long given up."""

from proper_worker import ProperWorker, run


class IgnoresDeadlines(ProperWorker):
    def refuse_late(self, job) -> None:
        return None


run(IgnoresDeadlines)
