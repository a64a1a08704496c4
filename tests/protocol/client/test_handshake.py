"""What a worker answers to `Hello`, and whether it takes our key, decides whether calls can be made to it."""

import math

import pytest

from protocol.client.handshake import Handshake, denial, name_of, objection
from protocol.errors import MalformedMessage, NotPermitted, Rejected, VersionMismatch, WrongRole
from protocol.messages import Drained, Failure, Role, Welcome
from protocol.security import Curve
from protocol.security.key_pair import new_key_pair

HERE = "tcp://gpu-box:5601"


def welcome(version: int = 1, role: Role = Role.RENDER) -> Welcome:
    return Welcome(version=version, role=role, incarnation="x", capabilities={}, heartbeat=0.5)


@pytest.mark.parametrize("serves", [Role.RENDER, None])
def test_who_speaks_our_version_and_serves_our_role_is_taken(serves):
    assert objection(welcome(), HERE, serves) is None


@pytest.mark.parametrize(
    ("answer", "kind", "words"),
    [
        (welcome(version=7), VersionMismatch, f"render at {HERE} wants version 7 of the protocol"),
        (welcome(role=Role.PERCEPTION), WrongRole, f"the worker at {HERE} serves perception, not render"),
        (Drained(), MalformedMessage, f"render at {HERE} answered Hello with Drained"),
        (Failure(code="unsupported", message="no Hello here"), Rejected, "no Hello here"),
        (MalformedMessage("the body is no map"), MalformedMessage, "the body is no map"),
    ],
)
def test_any_other_answer_is_an_objection_in_words(answer, kind, words):
    found = objection(answer, HERE, Role.RENDER)
    assert isinstance(found, kind)
    assert words in str(found)


def test_a_denial_names_the_key_that_was_not_taken():
    ours = new_key_pair("jetson", Role.PERCEPTION)
    told = str(denial(name_of(HERE, Role.RENDER), Curve(own=ours, server=ours.public)))
    assert told.startswith(f"render at {HERE} does not take our key 'jetson':")
    assert ours.secret not in told


@pytest.fixture
def handshake() -> Handshake:
    return Handshake(HERE, Role.RENDER, None)


def test_calls_are_refused_from_a_bad_answer_to_the_end_of_the_connection(handshake):
    assert handshake.refusal is None
    handshake.end(welcome(version=7), "x")
    assert isinstance(handshake.refusal, VersionMismatch)
    handshake.forget()
    assert handshake.refusal is None


def test_a_denial_stands_until_a_later_try_is_taken(handshake):
    handshake.deny()
    handshake.forget()
    assert isinstance(handshake.refusal, NotPermitted)
    handshake.begin()
    assert not handshake.is_denied
    assert handshake.refusal is None


@pytest.mark.parametrize(("theirs", "agreed"), [(0.1, 0.5), (2.0, 2.0), (1e9, 10.0), (math.nan, 0.5)])
def test_the_longer_heartbeat_counts_within_reason(handshake, theirs, agreed):
    assert handshake.heartbeat(0.5) == 0.5
    handshake.end(Welcome(version=1, role=Role.RENDER, incarnation="x", heartbeat=theirs), "x")
    assert handshake.heartbeat(0.5) == agreed
