"""Priorities of threads."""

import os
import sys
import threading

import pytest

from protocol.priority import let_others_go_first

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a priority belongs to a process")


def _priority() -> int:
    return os.getpriority(os.PRIO_PROCESS, threading.get_native_id())


def test_only_the_thread_that_asks_and_those_it_starts_go_later():
    seen: dict[str, int] = {}
    before = _priority()

    def child() -> None:
        seen["child"] = _priority()

    def computing() -> None:
        let_others_go_first()
        seen["computing"] = _priority()
        thread = threading.Thread(target=child)
        thread.start()
        thread.join()

    thread = threading.Thread(target=computing)
    thread.start()
    thread.join()
    assert seen["computing"] == seen["child"] == max(10, before)
    assert _priority() == before


def test_a_thread_that_goes_later_still_stays_there():
    seen: list[int] = []

    def idle() -> None:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 15)
        let_others_go_first()
        seen.append(_priority())

    thread = threading.Thread(target=idle)
    thread.start()
    thread.join()
    assert seen == [15]
