"""Learns where to fly: environments, learners, baselines and evaluation.

Importing it registers `vantage/Hover-v0`, `vantage/Hover-v1` and `vantage/Grid-v0` with Gymnasium. It loads neither
torch nor the environments themselves.
"""

import gymnasium

from protocol.environment_config import HoverConfig

gymnasium.register(
    id="vantage/Hover-v0",
    entry_point="agent.environment.hover:Hover",
    vector_entry_point="agent.environment.vector_hover:VectorHover",
)
gymnasium.register(
    id="vantage/Hover-v1",
    entry_point="agent.environment.hover:Hover",
    vector_entry_point="agent.environment.vector_hover:VectorHover",
    kwargs={"config": HoverConfig()},
)
gymnasium.register(
    id="vantage/Grid-v0",
    entry_point="agent.environment.grid.grid:Grid",
    vector_entry_point="agent.environment.grid.vector_grid:VectorGrid",
)
