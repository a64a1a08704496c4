"""Learns where to fly: environments, learners, baselines and evaluation.

Importing it registers `vantage/Hover-v0` with Gymnasium and loads neither torch nor the environment itself.
"""

import gymnasium

gymnasium.register(
    id="vantage/Hover-v0",
    entry_point="agent.environment.hover:Hover",
    vector_entry_point="agent.environment.vector_hover:VectorHover",
)
