"""What the networks get of an observation on the grid.

Next to the person, one cell more is a crash. With positions as two numbers alone, neighbouring cells were too much
alike to learn that soon: 0.5% of the episodes still crashed after two million steps, at their first or second move.
So a cell's column and row are given as one-hot vectors too. See docs/exploration.md for what was tried.
"""

import torch
from torch import Tensor

from agent.environment.grid.grid_map import OBSERVATION_SIZE
from protocol.grid.table import SIDE

_FARTHEST = SIDE // 2
"""Metres from the person along x or y."""

INPUT_SIZE = OBSERVATION_SIZE + 2 * SIDE


def encoded(observations: Tensor) -> Tensor:
    """(…, 58) of observations (…, 20): the position scaled to ±1, its column and row one-hot, certainties less a half.

    One-hot is the cell nearest to the position.
    """
    position, certainty = observations[..., :2], observations[..., 2:]
    cells = torch.arange(-_FARTHEST, _FARTHEST + 1, dtype=observations.dtype)
    one_hot = (position.round().unsqueeze(-1) == cells).to(observations.dtype)
    return torch.cat([position / _FARTHEST, one_hot.flatten(-2), certainty - 0.5], dim=-1)
