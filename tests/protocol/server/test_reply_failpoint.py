"""A worker can be struck between an answer and its way out."""

import signal

import pytest

from protocol.errors import DeadlineExceeded
from protocol.failpoint import VARIABLE, Failpoints
from protocol.messages import Sampled, SampleScene
from tests.protocol.processes.calls import ask, client_of
from tests.protocol.processes.serving import serving
from tests.protocol.workers.scenes import scene_for


def test_a_failpoint_is_reached_between_an_answer_and_its_way_out(address):
    reached = []

    def sample(request: SampleScene) -> Sampled:
        reached.append("answered")
        return scene_for(request.seed)

    with serving(address, {SampleScene: sample}, failpoint=reached.append), client_of(address) as client:
        client.call(ask(1))
        client.ping()
    assert reached == ["answered", "reply-render"]


@pytest.mark.slow
def test_what_a_worker_was_about_to_answer_when_it_was_killed_its_successor_answers(
    address, start, tmp_path, monkeypatch
):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    orders = Failpoints(tmp_path)
    orders.order("reply-render", "kill")
    worker = start("serves_scenes")
    with client_of(address) as client:
        pending = client.submit(ask(1))
        assert worker.wait(20) == -signal.SIGKILL
        assert not orders.is_pending("reply-render")
        start("serves_scenes")
        assert pending.result().scene.yaw == 1


@pytest.mark.slow
def test_a_reply_that_is_held_up_past_its_deadline_is_late(address, start, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    start("serves_scenes")
    with client_of(address) as client:
        client.wait_ready()
        Failpoints(tmp_path).order("reply-render", "wait 0.6")
        with pytest.raises(DeadlineExceeded):
            client.call(ask(1), deadline=0.3)
        assert client.call(ask(2)).scene.yaw == 2
        assert client.statistics.late_replies == 1
