import pytest

from orchestrator.monitoring.live_display import Snapshot
from orchestrator.pictures.worker_pair import worker_pair
from protocol.config import PerceptionConfig, RenderConfig, RunConfig
from protocol.errors import Interrupted
from protocol.messages import Role, SampleScene
from protocol.system.stop_request import StopRequest


class Quiet:
    def show(self, snapshot: Snapshot) -> None:
        pass


@pytest.fixture(autouse=True)
def stand_ins(monkeypatch, tmp_path, rooms):
    monkeypatch.setenv("PYTHONPATH", str(rooms / "well_behaved"))
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path))


def test_there_is_one_worker_of_each_role_whatever_the_configuration_says():
    config = RunConfig(render=RenderConfig(workers=4), perception=PerceptionConfig(workers=3))
    with worker_pair(config, display=Quiet(), stop=StopRequest()) as pair:
        assert pair.renderer.ping().state == pair.perceiver.ping().state == "ready"
        assert pair.renderer.wait_ready().role is Role.RENDER
        assert pair.renderer.call(SampleScene(seed=3, split="test")).scene.pose.kind == 3
        assert pair.perceiver.address.endswith("/perception-0")


def test_a_request_to_stop_ends_the_wait_for_the_pair():
    stop = StopRequest()
    stop.ask()
    with pytest.raises(Interrupted), worker_pair(RunConfig(), display=Quiet(), stop=stop):
        pytest.fail("nobody waits for a pair that was stopped")
