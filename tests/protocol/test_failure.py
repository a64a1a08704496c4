"""Errors keep their meaning across the wire."""

import pytest

from protocol import errors
from protocol.errors import InvalidInput, MalformedMessage, Rejected, VersionMismatch, WorkerLost
from protocol.failure import code_of, draining, error_of, failure_of, overloaded
from protocol.messages import Failure


@pytest.mark.parametrize(
    ("kind", "code"),
    [(InvalidInput, "invalid-input"), (errors.DeadlineExceeded, "deadline-exceeded"), (Rejected, "rejected")],
)
def test_a_code_is_the_error_s_name_in_kebab_case(kind, code):
    assert code_of(kind) == code


@pytest.mark.parametrize(
    ("error", "failure"),
    [
        (InvalidInput("NaN"), ("invalid-input", "NaN", False)),
        (MalformedMessage("half"), ("malformed-message", "half", False)),
        (WorkerLost("gone"), ("worker-lost", "gone", True)),
        (Rejected("full", code="overloaded", retryable=True), ("overloaded", "full", True)),
        (Rejected("never", code="unsupported", retryable=False), ("unsupported", "never", False)),
        (KeyError("x"), ("internal", "KeyError: 'x'", False)),
    ],
    ids=lambda value: type(value).__name__,
)
def test_an_error_becomes_a_failure(error, failure):
    made = failure_of(error)
    assert (made.code, made.message, made.retryable) == failure


def test_a_long_message_is_cut():
    assert len(failure_of(InvalidInput("x" * 100_000)).message) == 2000


def test_a_failure_becomes_an_error_that_says_who_and_what():
    error = error_of(Failure(code="invalid-input", message="NaN"), "render at ipc:///r", "Render")
    assert isinstance(error, Rejected)
    assert str(error) == "render at ipc:///r rejected Render (invalid-input): NaN"


def test_a_version_mismatch_stays_one():
    failure = failure_of(VersionMismatch("7 to 9"))
    assert isinstance(error_of(failure, "render at ipc:///r", "Hello"), VersionMismatch)


def test_what_passes_by_itself_can_be_tried_again():
    assert draining().retryable
    assert overloaded(64).retryable
