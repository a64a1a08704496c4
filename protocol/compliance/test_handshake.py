"""Hello and Welcome: both sides learn the other's role and version."""

import math

import pytest

from protocol.compliance.wire import Wire, changed, parts_of
from protocol.messages import PROTOCOL_VERSION, Failure, Hello, Ping, Role, Welcome


def hello(oldest: int = PROTOCOL_VERSION, newest: int = PROTOCOL_VERSION) -> Hello:
    """A client that speaks these versions."""
    return Hello(oldest_version=oldest, newest_version=newest, role=Role.AGENT, incarnation="compliance")


def test_hello_is_answered_by_welcome(wire: Wire) -> None:
    """Hello is answered by Welcome: a version, an incarnation of 1 to 64 characters, and a heartbeat above 0.

    The client compares incarnations to notice a restart, and pings at the heartbeat.
    """
    welcome = wire.call(hello())
    assert isinstance(welcome, Welcome)
    assert welcome.version == PROTOCOL_VERSION
    assert 0 < len(welcome.incarnation) <= 64
    assert 0 < welcome.heartbeat < math.inf


def test_every_reply_names_the_same_incarnation(wire: Wire) -> None:
    """The header of each reply, Welcome and Pong name one and the same incarnation for as long as the process lives.

    A reply with another incarnation tells a client that its worker was replaced, and the client sends the calls of the
    old one again.
    """
    greeted = wire.answer(wire.ask(hello()))
    ponged = wire.answer(wire.ask(Ping()))
    assert isinstance(greeted.message, Welcome)
    names = {
        greeted.header.incarnation,
        greeted.message.incarnation,
        ponged.header.incarnation,
        wire.ping().incarnation,
    }
    assert len(names) == 1


def test_the_version_agreed_on_is_one_that_was_offered(wire: Wire) -> None:
    """Where the client offers more versions than the worker speaks, Welcome names the newest that both speak.

    A worker may be updated before its clients and after them.
    """
    welcome = wire.call(hello(oldest=0, newest=PROTOCOL_VERSION + 98))
    assert isinstance(welcome, Welcome)
    assert PROTOCOL_VERSION <= welcome.version < PROTOCOL_VERSION + 98
    older = wire.call(hello(oldest=0, newest=PROTOCOL_VERSION))
    assert isinstance(older, Welcome)
    assert older.version == PROTOCOL_VERSION


@pytest.mark.parametrize(("oldest", "newest"), [(900, 909), (0, 0)], ids=["all newer", "all older"])
def test_a_hello_without_a_common_version_is_refused(wire: Wire, oldest: int, newest: int) -> None:
    """A client that shares no version with the worker is answered by `version-mismatch`, not retryable.

    Silence would keep the client waiting for its startup timeout; after a Welcome it would send unreadable messages.
    """
    failure = wire.call(hello(oldest, newest))
    assert isinstance(failure, Failure), failure
    assert (failure.code, failure.retryable) == ("version-mismatch", False)


def test_a_hello_is_read_in_any_version(wire: Wire) -> None:
    """Hello is read with any version in its prelude, since it comes before both sides have agreed on a version."""
    wire.send(parts_of(hello(900, 909), wire.next_number(), version=909))
    failure = wire.receive("the answer to Hello").message
    assert isinstance(failure, Failure), failure
    assert failure.code == "version-mismatch"


def test_another_message_in_a_foreign_version_is_refused(wire: Wire) -> None:
    """Any other message in a version that the worker does not speak is answered by `version-mismatch`.

    Its meaning can't be known, even if it can be decoded.
    """
    number = wire.next_number()
    wire.send(parts_of(Ping(), number, version=909))
    failure = wire.answer(number).message
    assert isinstance(failure, Failure), failure
    assert failure.code == "version-mismatch"


def test_a_second_hello_on_a_connection_is_answered_as_the_first(wire: Wire) -> None:
    """A worker keeps no state of its clients: Hello may come again, and late."""
    first, second = wire.call(hello()), wire.call(hello())
    assert isinstance(first, Welcome)
    assert isinstance(second, Welcome)
    assert first.incarnation == second.incarnation


def test_fields_of_a_later_hello_are_passed_over(wire: Wire) -> None:
    """Unknown fields of a Hello are ignored, so that newer clients can greet older workers."""
    number = wire.next_number()
    prelude, header, body = parts_of(hello(), number)
    wire.send([prelude, header, changed(body, lambda fields: fields.update(added_later=[1, {"a": 2}]))])
    assert isinstance(wire.answer(number).message, Welcome)
