import asyncio

from protocol.telemetry.liveness import liveness


class Works:
    """Takes a turn at every third wake-up: another thread took the earlier messages."""

    def __init__(self):
        self.turns = 7
        self.woken = 0

    def wake(self):
        self.woken += 1
        self.turns += self.woken % 3 == 0


class Hangs(Works):
    def wake(self):
        self.woken += 1


def test_who_takes_a_turn_lives_though_it_was_to_be_woken_again():
    thread = Works()
    assert asyncio.run(liveness([thread], patience=20)).live
    assert thread.turns == 8


def test_one_thread_that_hangs_is_enough():
    thread = Hangs()
    assert not asyncio.run(liveness([Works(), thread], patience=0.05)).live
    assert thread.woken > 0


def test_a_process_without_such_threads_lives():
    assert asyncio.run(liveness([])).live
