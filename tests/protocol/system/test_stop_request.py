import os
import signal
import time

import pytest

from protocol.errors import Interrupted
from protocol.system.signals import ENDING
from protocol.system.stop_request import TERMINAL, StopRequest, stop_on_signals


@pytest.fixture(autouse=True)
def _no_signal_is_ignored():
    """Whoever runs the tests under nohup or in a shell's background has them ignored."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in TERMINAL}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", TERMINAL)
def test_a_signal_asks_to_stop_and_nothing_else_happens(number):
    with stop_on_signals() as stop:
        assert not stop.is_asked
        os.kill(os.getpid(), number)
        assert stop.is_asked
        assert not stop.is_urgent


def test_a_second_signal_is_handled_as_before_where_one_is_enough():
    # A shell starts what runs in the background with SIGINT ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with stop_on_signals(ENDING, once=True) as stop:
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        assert not stop.is_urgent
    finally:
        signal.signal(signal.SIGINT, before)


def test_asking_twice_is_urgent():
    with stop_on_signals() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.is_urgent


def test_signals_mean_afterwards_what_they_meant_before():
    before = [signal.getsignal(number) for number in TERMINAL]
    with stop_on_signals():
        assert [signal.getsignal(number) for number in TERMINAL] != before
    assert [signal.getsignal(number) for number in TERMINAL] == before


def test_a_terminal_that_closes_is_ignored_under_nohup():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stop_on_signals() as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not stop.is_asked
        assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_check_raises_only_when_asked():
    stop = StopRequest()
    stop.check()
    stop.ask()
    with pytest.raises(Interrupted):
        stop.check()


def test_a_sleep_ends_early_when_somebody_asks():
    with stop_on_signals() as stop:
        signal.setitimer(signal.ITIMER_REAL, 0)
        before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        began = time.monotonic()
        stop.sleep(60.0)
        signal.signal(signal.SIGALRM, before)
    assert stop.is_asked
    assert time.monotonic() - began < 30.0


def test_a_sleep_ends_early_when_what_it_waits_for_is_there():
    began = time.monotonic()
    StopRequest().sleep(60.0, until=lambda: True)
    assert time.monotonic() - began < 30.0
