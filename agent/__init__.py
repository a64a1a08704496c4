"""Learns where to fly: environments, learners, baselines and evaluation.

Importing it registers `vantage/Hover-v0` with Gymnasium and loads neither torch nor the environment itself.
"""

import gymnasium

gymnasium.register(
    id="vantage/Hover-v0",
    entry_point="agent.hover:Hover",
    vector_entry_point="agent.vector_hover:VectorHover",
)
