import pytest

from protocol.environment_config import EnvironmentConfig
from tests.agent.analytic_sensor import AnalyticSensor


@pytest.fixture
def sensor() -> AnalyticSensor:
    return AnalyticSensor()


@pytest.fixture
def config() -> EnvironmentConfig:
    return EnvironmentConfig()
