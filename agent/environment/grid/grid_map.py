"""The views of a grid's environments as a drone gets them: arrays that a walk only indexes."""

from typing import Self

import numpy as np
from msgspec import Struct

from agent.environment.grid.cells import POSITIONS
from protocol.arrays import Float32Array
from protocol.grid.table import CELLS, CENTRE, GridPlace, GridTable
from protocol.grid.threshold import weighted_uncertainties
from protocol.grid_config import GridObservation
from protocol.scene import Split
from protocol.skeleton import JOINT_COUNT

OBSERVATION_SIZE = 2 + JOINT_COUNT

MOST_UNCERTAIN = 10.0
"""The weighted uncertainty of a view that shows nobody, and of the cell in which the person stands."""


class GridMap(Struct, frozen=True, eq=False, kw_only=True):
    """All environments of a split.

    Attributes:
        places: the environments.
        observations: (n, 361, 20) x and y in metres from the person, and of each joint the certainty, 0 to 1.
        uncertainty: (n, 361) weighted over the upper body, 0 to 10.
    """

    places: tuple[GridPlace, ...]
    observations: Float32Array
    uncertainty: Float32Array

    @classmethod
    def of_table(cls, table: GridTable, split: Split, observation: GridObservation = "quality") -> Self:
        """The map of a table's split; with `position`, the observations have zeros in place of the certainties."""
        chosen = table.of_split(split)
        certainties = 1.0 - table.uncertainties()[chosen]
        certainties[:, CENTRE] = 0.0
        observations = np.zeros((len(chosen), CELLS, OBSERVATION_SIZE), np.float32)
        observations[:, :, :2] = POSITIONS
        if observation == "quality":
            observations[:, :, 2:] = certainties
        return cls(
            places=tuple(table.places[number] for number in chosen),
            observations=observations,
            uncertainty=weighted_uncertainties(table)[chosen].astype(np.float32),
        )
