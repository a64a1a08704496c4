"""Requests under way at once, and the replies that belong to them."""

from protocol.compliance.wire import Connect, Wire
from protocol.compliance.work import Work
from protocol.messages import Failure

_UNDER_WAY = 8


def test_work_is_answered_by_what_was_asked_for(wire: Wire, work: Work) -> None:
    """The worker answers the work of its role."""
    for request in (work.small(), work.large()):
        reply = wire.call(request)
        assert work.answers(reply, request), reply


def test_every_further_request_of_the_role_is_answered(wire: Wire, work: Work) -> None:
    """Each request of the role is answered by its reply, or by a Failure that says what is missing.

    `unsupported` is for other roles' requests, `internal` for mistakes.
    """
    for request in work.others():
        reply = wire.call(request)
        assert not isinstance(reply, Failure) or reply.code not in ("unsupported", "internal", "malformed-message"), (
            reply
        )


def test_each_reply_has_its_request_s_id(wire: Wire, work: Work) -> None:
    """Several requests may be under way; each is answered once, under its own id, in any order.

    A worker may work on several at once, and the client tells the replies apart by their ids alone.
    """
    asked = {wire.ask(request): request for request in map(work.small, range(_UNDER_WAY))}
    for answer in wire.answers(asked):
        assert work.answers(answer.message, asked[answer.header.request]), "a reply has another request's id"
    assert not wire.answers_before_a_ping(), "a request was answered twice"


def test_any_id_comes_back_as_it_was(wire: Wire, work: Work) -> None:
    """Ids are any integers from 0 to 2⁶³-1, in any order; a reply has all 63 bits of its request's.

    A double has 53 of them, and a client of another language may start anywhere.
    """
    numbers = (2**63 - 1, 0, 2**53 + 1, 2**32, 7)
    for number in numbers:
        wire.ask(work.small(), number)
    came = [wire.receive(f"the reply to one of {numbers}").header.request for _ in numbers]
    assert sorted(came) == sorted(numbers)


def test_two_clients_may_use_the_same_ids(connect: Connect, work: Work) -> None:
    """Ids are unique on a connection only; a reply goes to the client that sent the request."""
    one, other = connect(), connect()
    for tag in range(_UNDER_WAY):
        one.ask(work.small(tag), number=tag)
        other.ask(work.small(100 + tag), number=tag)
    for wire, first in ((one, 0), (other, 100)):
        for answer in wire.answers(range(_UNDER_WAY)):
            assert work.answers(answer.message, work.small(first + answer.header.request)), (
                "another client's reply came"
            )


def test_the_same_request_brings_the_same_reply(wire: Wire, work: Work) -> None:
    """A request that is sent again, under another id, is answered again.

    Requests are pure: a client that does not know whether one was answered sends it again.
    """
    request = work.small(5)
    for _ in range(2):
        assert work.answers(wire.call(request), request)


def test_a_client_that_left_without_its_replies_harms_no_other(connect: Connect, work: Work) -> None:
    """If a client disconnects with requests under way, all other clients still get their replies."""
    leaving = connect()
    for tag in range(_UNDER_WAY):
        leaving.ask(work.small(tag))
    leaving.ping()
    leaving.close()
    request = work.small()
    assert work.answers(connect().call(request), request)
