"""Priorities of threads."""

import ctypes
import os
import platform
import struct
import sys
import threading

import psutil
import pytest
import zmq

from protocol.system.priority import go_first, going_first, let_others_go_first
from protocol.transport.sockets import new_context

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


def test_whoever_computes_gives_the_lock_of_python_away_sooner():
    before = sys.getswitchinterval()
    try:
        thread = threading.Thread(target=let_others_go_first)
        thread.start()
        thread.join()
        assert sys.getswitchinterval() < 0.002
    finally:
        sys.setswitchinterval(before)


def _slice_of(thread: int) -> int:
    """Nanoseconds of its turns, from sched_getattr(2)."""
    number = {"x86_64": 315, "aarch64": 275}[platform.machine()]
    attributes = ctypes.create_string_buffer(48)
    assert ctypes.CDLL(None).syscall(number, thread, attributes, 48, 0) == 0
    return struct.unpack_from("<Q", attributes.raw, 24)[0]


def _threads() -> set[int]:
    return {thread.id for thread in psutil.Process().threads()}


@pytest.fixture
def usual() -> int:
    usual = _slice_of(0)
    if not usual:
        pytest.skip("this system has no slices of a thread's own (Linux 6.12)")
    return usual


def test_a_thread_that_goes_first_asks_for_short_turns_and_keeps_its_priority(usual):
    seen: list[tuple[int, int]] = []

    def carrying() -> None:
        go_first()
        seen.append((_slice_of(0), _priority()))

    thread = threading.Thread(target=carrying)
    thread.start()
    thread.join()
    assert seen == [(100_000, _priority())]
    assert _slice_of(0) == usual


def test_only_what_is_started_within_goes_first(usual):
    seen: list[int] = []

    def child() -> None:
        seen.append(_slice_of(0))

    with going_first():
        thread = threading.Thread(target=child)
        thread.start()
        thread.join()
    assert seen == [100_000]
    assert _slice_of(0) == usual


def test_the_threads_of_a_context_go_first(usual):
    before = _threads()
    with new_context() as context, context.socket(zmq.PAIR):
        of_context = _threads() - before
        assert len(of_context) == 2
        assert {_slice_of(thread) for thread in of_context} == {100_000}
    assert _slice_of(0) == usual
