import pytest

from agent.learning.recurrent.schedule import linear_schedule


@pytest.mark.parametrize(("steps", "setting"), [(0, 0.3), (250, 0.25), (500, 0.2), (1000, 0.1), (5000, 0.1)])
def test_a_setting_falls_evenly_and_then_stays(steps: int, setting: float) -> None:
    assert linear_schedule(steps, first=0.3, last=0.1, over=1000) == pytest.approx(setting)
