"""What is put in by any thread comes out once, in order, and wakes the reader."""

import os
import select
import signal
import threading

import pytest

from protocol.transport.mailbox import Mailbox


def is_readable(mailbox: Mailbox, seconds: float) -> bool:
    return bool(select.select([mailbox], [], [], seconds)[0])


def test_things_come_out_once_and_in_order():
    mailbox: Mailbox[int] = Mailbox()
    for number in range(3):
        mailbox.put(number)
    assert mailbox.take() == [0, 1, 2]
    assert mailbox.take() == []
    mailbox.close()


def test_the_reader_is_woken():
    mailbox: Mailbox[int] = Mailbox()
    thread = threading.Timer(0.05, mailbox.put, [1])
    assert not is_readable(mailbox, 0)
    thread.start()
    assert is_readable(mailbox, 20)
    mailbox.clear_wakeups()
    assert not is_readable(mailbox, 0)
    assert mailbox.take() == [1]
    thread.join()
    mailbox.close()


def test_an_item_is_handled_in_the_thread_that_puts_it_while_the_reader_waits():
    mailbox: Mailbox[int] = Mailbox()
    in_use, handled = threading.Lock(), []
    mailbox.put_or_handle(1, in_use, lambda: handled.append((mailbox.take(), in_use.locked())))
    assert handled == [([1], True)]
    assert not is_readable(mailbox, 0)
    assert not in_use.locked()
    mailbox.close()


def test_who_handles_what_it_brings_leaves_a_signal_to_the_reader():
    mailbox: Mailbox[int] = Mailbox()
    os.write(mailbox.wakeup_descriptor, bytes([signal.SIGTERM]))
    mailbox.put_or_handle(1, threading.Lock(), mailbox.take)
    assert is_readable(mailbox, 0)
    mailbox.close()


def test_a_thing_is_left_for_who_is_at_work():
    mailbox: Mailbox[int] = Mailbox()
    with (in_use := threading.Lock()):
        mailbox.put_or_handle(1, in_use, lambda: pytest.fail("it was handled beside who is at work"))
    assert is_readable(mailbox, 0)
    assert mailbox.take() == [1]
    mailbox.close()


def test_a_signal_wakes_the_reader_and_is_told():
    mailbox: Mailbox[int] = Mailbox()
    mailbox.put(1)
    mailbox.clear_wakeups()
    assert not mailbox.was_signalled
    os.write(mailbox.wakeup_descriptor, bytes([signal.SIGTERM]))
    assert is_readable(mailbox, 0)
    assert mailbox.take() == [1]
    mailbox.clear_wakeups()
    assert mailbox.was_signalled
    assert not is_readable(mailbox, 0)
    mailbox.close()


def test_nothing_is_lost_between_threads():
    mailbox: Mailbox[int] = Mailbox()

    def put_all(numbers: range) -> None:
        for number in numbers:
            mailbox.put(number)

    threads = [threading.Thread(target=put_all, args=(range(start, 20_000, 4),)) for start in range(4)]
    for thread in threads:
        thread.start()
    taken: list[int] = []
    while len(taken) < 20_000:
        assert is_readable(mailbox, 20)
        mailbox.clear_wakeups()
        taken += mailbox.take()
    for thread in threads:
        thread.join()
    assert sorted(taken) == list(range(20_000))
    mailbox.close()


def test_an_item_put_after_the_end_is_kept_and_does_no_harm():
    mailbox: Mailbox[int] = Mailbox()
    mailbox.close()
    mailbox.put(1)
    assert mailbox.take() == [1]
