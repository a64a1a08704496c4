import pytest

from protocol.config import EnvironmentConfig
from tests.agent.analytic_eyes import AnalyticEyes


@pytest.fixture
def eyes() -> AnalyticEyes:
    return AnalyticEyes()


@pytest.fixture
def config() -> EnvironmentConfig:
    return EnvironmentConfig()
