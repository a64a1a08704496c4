"""The version of Hover that a configuration is of."""

from agent.environment.hover_task import HoverTask, HoverV0
from agent.environment.v1.task import HoverV1
from protocol.environment_config import EnvironmentConfig, HoverConfig


def hover_task(config: EnvironmentConfig) -> HoverTask:
    """Version 1 of a `HoverConfig`, else version 0."""
    return HoverV1(config) if isinstance(config, HoverConfig) else HoverV0(config)
