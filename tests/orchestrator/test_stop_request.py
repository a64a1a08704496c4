import os
import signal
import time

import pytest

from orchestrator.errors import Interrupted
from orchestrator.stop_request import SIGNALS, StopRequest, stop_on_signals


@pytest.fixture(autouse=True)
def _no_signal_is_ignored():
    """Whoever runs the tests under nohup or in a shell's background has them ignored."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_asks_to_stop_and_nothing_else_happens(number):
    with stop_on_signals() as stop:
        assert not stop.is_asked
        os.kill(os.getpid(), number)
        assert stop.is_asked
        assert not stop.is_urgent


def test_asking_twice_is_urgent():
    with stop_on_signals() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop.is_urgent


def test_signals_mean_afterwards_what_they_meant_before():
    before = [signal.getsignal(number) for number in SIGNALS]
    with stop_on_signals():
        assert [signal.getsignal(number) for number in SIGNALS] != before
    assert [signal.getsignal(number) for number in SIGNALS] == before


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


def test_a_nap_ends_early_when_somebody_asks():
    with stop_on_signals() as stop:
        signal.setitimer(signal.ITIMER_REAL, 0)
        before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGTERM))
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        began = time.monotonic()
        stop.nap(60.0)
        signal.signal(signal.SIGALRM, before)
    assert stop.is_asked
    assert time.monotonic() - began < 30.0


def test_a_nap_ends_early_when_what_it_waits_for_is_there():
    began = time.monotonic()
    StopRequest().nap(60.0, until=lambda: True)
    assert time.monotonic() - began < 30.0
