"""Learns where to fly: environments, learners, baselines and evaluation.

Importing it registers `vantage/Hover-v0` and `vantage/Grid-v0` with Gymnasium. It loads neither torch nor the
environments themselves.
"""

import gymnasium

gymnasium.register(
    id="vantage/Hover-v0",
    entry_point="agent.environment.hover:Hover",
    vector_entry_point="agent.environment.vector_hover:VectorHover",
)
gymnasium.register(
    id="vantage/Grid-v0",
    entry_point="agent.environment.grid.grid:Grid",
    vector_entry_point="agent.environment.grid.vector_grid:VectorGrid",
)
