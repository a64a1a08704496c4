"""Computes with every value that it is sent, and reports an impossible number as an error of its own."""

from proper_worker import ProperWorker, run

from protocol.errors import ImpossibleValue
from protocol.failure import internal


class TakesAnyValueForItsOwnMistake(ProperWorker):
    def told(self, error):
        if isinstance(error, ImpossibleValue):
            return internal("ZeroDivisionError: float division by zero")
        return super().told(error)


run(TakesAnyValueForItsOwnMistake)
