import pytest

from orchestrator.supervision.recycling import reason_to_recycle
from protocol.config import SupervisionConfig
from protocol.messages import Pong, State

MIB = 2**20


def pong(progress: int = 10, mebibytes: int = 100) -> Pong:
    return Pong(incarnation="a", state=State.READY, progress=progress, queue_depth=0, resident_bytes=mebibytes * MIB)


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        (SupervisionConfig(recycle_bytes=99 * MIB), "takes 100 MiB, more than 99"),
        (SupervisionConfig(recycle_bytes=100 * MIB), None),
        (SupervisionConfig(recycle_requests=10), "has answered 10 requests"),
        (SupervisionConfig(recycle_requests=11), None),
        (SupervisionConfig(recycle_bytes=0, recycle_requests=0), None),
    ],
)
def test_a_worker_is_replaced_past_either_limit_and_never_where_there_is_none(config, reason):
    assert reason_to_recycle(pong(), config) == reason


def test_a_worker_that_has_answered_nothing_is_not_replaced_however_large_it_is():
    assert reason_to_recycle(pong(progress=0), SupervisionConfig(recycle_bytes=1)) is None
    assert reason_to_recycle(None, SupervisionConfig(recycle_bytes=1)) is None
