"""Keeps ids in 32 bits, as a language without long integers may."""

from proper_worker import ProperWorker, run


class ForgetsTheUpperHalfOfRequestIds(ProperWorker):
    def sealed(self, number, reply):
        return super().sealed(number % 2**32, reply)


run(ForgetsTheUpperHalfOfRequestIds)
