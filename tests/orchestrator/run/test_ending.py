import errno

import pytest

from orchestrator.errors import RunError
from orchestrator.run.ending import Ending, ending_by
from protocol.errors import Interrupted


@pytest.mark.parametrize(
    ("error", "outcome", "reason"),
    [
        (Interrupted("training was stopped on request"), "stopped", "training was stopped on request"),
        (KeyboardInterrupt(), "stopped", None),
        (RunError("it is damaged"), "failed", "it is damaged"),
        (OSError(errno.ENOSPC, "No space left on device"), "failed", "No space left on device; free some space"),
        (KeyError("x"), "failed", "KeyError: 'x'"),
    ],
)
def test_what_ended_before_all_was_done_says_why(error, outcome, reason):
    assert ending_by(error, 1e9) == Ending(time=1e9, outcome=outcome, reason=reason)


def test_an_end_is_written_down_whatever_bytes_its_reason_names(run):
    run.end(Ending(time=1e9, outcome="failed", reason="caf\udce9.onnx is missing"))
    assert run.ending() == Ending(time=1e9, outcome="failed", reason="caf?.onnx is missing")
