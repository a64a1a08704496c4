import errno

import pytest

from protocol.errors import (
    AddressUnavailable,
    ArtifactDamaged,
    ArtifactMissing,
    ClientClosed,
    DeadlineExceeded,
    InvalidConfig,
    InvalidInput,
    LimitExceeded,
    MalformedMessage,
    NotPermitted,
    Rejected,
    Unavailable,
    VersionMismatch,
    WorkerLost,
    WrongRole,
)
from protocol.system.exit_code import ExitCode, exit_code_of


@pytest.mark.parametrize(
    "kind",
    [
        AddressUnavailable,
        ArtifactDamaged,
        ArtifactMissing,
        InvalidConfig,
        InvalidInput,
        LimitExceeded,
        NotPermitted,
        Unavailable,
        VersionMismatch,
        WrongRole,
    ],
)
def test_what_would_happen_again_is_hopeless(kind):
    assert exit_code_of(kind("again")) is ExitCode.HOPELESS


@pytest.mark.parametrize(
    "error",
    [
        ClientClosed("closed"),
        DeadlineExceeded("late"),
        MalformedMessage("noise"),
        Rejected("not now", code="overloaded", retryable=True),
        WorkerLost("gone"),
        OSError(errno.ENOSPC, "No space left on device"),
        MemoryError(),
        ZeroDivisionError(),
    ],
)
def test_what_may_pass_is_a_failure_for_now(error):
    assert exit_code_of(error) is ExitCode.FAILED


def test_the_codes_are_what_supervisors_elsewhere_are_told():
    assert {code.name: int(code) for code in ExitCode} == {"DONE": 0, "HOPELESS": 2, "FAILED": 3}
