"""Workers that misbehave, each in a process of its own: every call still ends by its deadline, with its own reply or a
typed error.
"""

import signal

import pytest

from protocol import Client, Timeouts
from protocol.errors import (
    ClientClosed,
    DeadlineExceeded,
    MalformedMessage,
    VersionMismatch,
    WorkerLost,
)
from protocol.messages import Role, State
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.waiting import wait_until

pytestmark = pytest.mark.slow


def test_a_worker_that_never_answers_is_told_with_its_health(address, start):
    start("never_answers")
    with client_of(address, serves=Role.RENDER) as client:
        client.wait_ready()
        with pytest.raises(DeadlineExceeded) as caught:
            client.call(ask(1), deadline=0.2)
    message = str(caught.value)
    assert message.startswith(f"render at {address} did not answer SampleScene within 0.2 s (1 try); it was heard ")
    assert " s ago, ready, with 0 requests in hand and 0 answered; allow it more time" in message


def test_a_late_reply_is_not_taken_for_the_next_answer(address, start):
    start("answers_late")
    with client_of(address) as client:
        client.wait_ready()
        with pytest.raises(DeadlineExceeded):
            client.call(ask(1), deadline=0.1)
        assert client.call(ask(2)).scene.yaw == 2
        assert client.statistics.late_replies == 1


def test_a_second_answer_is_not_taken_for_the_next_one(address, start):
    start("answers_twice")
    with client_of(address) as client:
        assert [client.call(ask(seed)).scene.yaw for seed in range(20)] == list(range(20))
        assert client.statistics.late_replies >= 19


def test_garbage_ends_the_call_it_answers_and_no_other(address, start):
    start("answers_garbage")
    with client_of(address) as client:
        for seed in range(3):
            with pytest.raises(MalformedMessage, match="Sampled: "):
                client.call(ask(seed))
        assert client.statistics.malformed == 6
        assert client.ping().state is State.READY


def test_a_reply_of_another_kind_is_malformed(address, start):
    start("answers_something_else")
    with (
        client_of(address) as client,
        pytest.raises(MalformedMessage, match=f"{address} answered SampleScene with Pong"),
    ):
        client.call(ask(1))


def test_a_worker_that_is_killed_in_mid_call_and_not_started_again_is_lost(address, start):
    worker = start("never_answers")
    with client_of(address) as client:
        client.wait_ready()
        pending = client.submit(ask(1), deadline=2.0)
        client.ping()
        worker.kill()
        with pytest.raises(WorkerLost) as caught:
            pending.result()
        assert str(caught.value) == (
            f"worker at {address} was lost while it held SampleScene, and none took it within 2 s (1 try); "
            "is it running? See 'orchestrator status'"
        )
        assert client.statistics.losses == 1


def test_a_worker_that_dies_after_hello_is_lost(address, start):
    start("dies_after_hello")
    with client_of(address) as client, pytest.raises(WorkerLost):
        client.call(ask(1), deadline=3.0)


def test_what_a_killed_worker_held_is_answered_by_the_next_one(address, start):
    worker = start("never_answers")
    with client_of(address) as client:
        client.wait_ready()
        pending = [client.submit(ask(seed)) for seed in range(5)]
        client.ping()
        worker.kill()
        worker.wait()
        start("serves_scenes")
        assert [one.result().scene.yaw for one in pending] == list(range(5))
        assert client.statistics.losses == client.statistics.retries == 5


def test_a_worker_that_stands_still_for_a_while_costs_only_time(address, start):
    worker = start("serves_scenes")
    with client_of(address, Timeouts(call=20, startup=20, heartbeat=0.05, silence=0.2)) as client:
        client.wait_ready()
        worker.send_signal(signal.SIGSTOP)
        with pytest.raises((DeadlineExceeded, WorkerLost)):
            client.call(ask(1), deadline=2.0)
        assert client.statistics.losses > 0
        worker.send_signal(signal.SIGCONT)
        assert client.call(ask(2)).scene.yaw == 2


def test_a_worker_that_was_replaced_has_another_incarnation(address, start):
    worker = start("serves_scenes")
    with client_of(address) as client:
        before = client.wait_ready().incarnation
        worker.kill()
        worker.wait()
        start("serves_scenes")
        assert client.wait_ready().incarnation != before


def test_a_worker_that_is_another_after_every_request_is_lost_each_time(address, start):
    start("forgets_who_it_is")
    with client_of(address) as client:
        client.wait_ready()
        pending = client.submit(ask(1), deadline=5.0)
        wait_until(lambda: client.statistics.losses > 1)
        with pytest.raises((WorkerLost, DeadlineExceeded)):
            pending.result()


def test_a_worker_that_wants_no_pings_keeps_no_call_from_its_deadline(address, start):
    start("wants_no_pings")
    with client_of(address) as client, pytest.raises(MalformedMessage, match="answered SampleScene with Welcome"):
        client.call(ask(1))


def test_a_process_that_forgets_to_close_its_client_still_ends(address, start):
    assert start("forgets_to_close").wait(20) == 0


def test_a_worker_of_another_version_is_a_typed_error(address, start):
    start("speaks_versions_7_to_9")
    with client_of(address) as client:
        with pytest.raises(VersionMismatch, match="wants version 9 of the protocol; this process speaks 1 to 1"):
            client.wait_ready()
        with pytest.raises(VersionMismatch):
            client.call(ask(1))


def test_a_refused_address_is_tried_again_when_another_worker_takes_it(address, start):
    worker = start("speaks_versions_7_to_9")
    with client_of(address) as client:
        with pytest.raises(VersionMismatch):
            client.wait_ready()
        worker.kill()
        worker.wait()
        start("serves_scenes")
        wait_until(lambda: not is_refused(client))
        assert client.call(ask(1)).scene.yaw == 1


def is_refused(client: Client) -> bool:
    """Whether the client still has to do with the worker of another version."""
    try:
        client.wait_ready()
    except VersionMismatch:
        return True
    return False


def test_silence_after_the_connection_is_told_as_such(address, start):
    start("never_says_welcome")
    with (
        client_of(address, Timeouts(startup=2.0)) as client,
        pytest.raises(DeadlineExceeded, match=r"not ready within 2 s: .* never said Welcome; is it a Vantage worker"),
    ):
        client.wait_ready()


def test_closing_ends_what_is_under_way(address, start):
    start("never_answers")
    client = client_of(address)
    client.wait_ready()
    pending = client.submit(ask(1))
    client.close()
    with pytest.raises(ClientClosed, match="the client is closed before SampleScene was answered"):
        pending.result()
    with pytest.raises(ClientClosed):
        client.call(ask(2))
    client.close()


def test_a_cancelled_call_disturbs_no_other(address, start):
    start("answers_late")
    with client_of(address) as client:
        client.wait_ready()
        cancelled = client.submit(ask(1))
        client.ping()
        assert cancelled.cancel()
        assert client.call(ask(2)).scene.yaw == 2
        assert cancelled.cancelled()
