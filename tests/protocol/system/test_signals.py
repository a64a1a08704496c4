import os
import signal
import threading

from protocol.system.signals import signals_handled, signals_written_to


def test_a_handler_is_told_the_number_and_the_earlier_one_is_back_afterwards():
    told: list[int] = []
    before = signal.getsignal(signal.SIGUSR1)
    with signals_handled((signal.SIGUSR1,), told.append):
        signal.raise_signal(signal.SIGUSR1)
    assert told == [signal.SIGUSR1]
    assert signal.getsignal(signal.SIGUSR1) == before


def test_the_earlier_handler_can_be_had_back_before_the_end():
    before = signal.getsignal(signal.SIGUSR1)
    with signals_handled((signal.SIGUSR1,), lambda _: None) as restore:
        assert signal.getsignal(signal.SIGUSR1) != before
        restore()
        assert signal.getsignal(signal.SIGUSR1) == before


def test_a_signal_is_written_to_a_descriptor():
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    try:
        with signals_handled((signal.SIGUSR1,), lambda _: None), signals_written_to(writing):
            signal.raise_signal(signal.SIGUSR1)
            assert os.read(reading, 1) == bytes((signal.SIGUSR1,))
    finally:
        os.close(reading)
        os.close(writing)


def test_a_thread_other_than_the_main_one_changes_nothing():
    before = signal.getsignal(signal.SIGUSR1)
    inside: list[object] = []

    def run() -> None:
        with signals_handled((signal.SIGUSR1,), lambda _: None), signals_written_to(-1):
            inside.append(signal.getsignal(signal.SIGUSR1))

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert inside == [before]
