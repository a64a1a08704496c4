"""Made-up tables of a grid, for tests of what is read from one."""

from collections.abc import Mapping

import numpy as np

from protocol.grid.table import CELLS, QUANTITIES, SHARES, Certainty, GridPlace, GridRecipe, GridTable, Quantity
from protocol.skeleton import JOINT_COUNT


def recipe(certainty: Certainty = "quality") -> GridRecipe:
    return GridRecipe(certainty=certainty, version="0.1.0", config="", views="{}", perception={"lifting": "mean"})


def train_place(number: int = 0) -> GridPlace:
    return GridPlace(split="train", seed=100 + number, identity=number % 40, pose=number % 6, yaw=0.5)


def place_to_test(number: int = 0) -> GridPlace:
    return GridPlace(split="test", seed=200 + number, identity=40 + number % 20, pose=number % 8, yaw=-1.5)


def quantities(random: np.random.Generator, cells: int = CELLS) -> dict[Quantity, np.ndarray]:
    """Of one environment: shares from 0 to 1, lengths of 5 mm to 5 m, each tenth without an estimate."""
    lengths = np.exp(random.uniform(np.log(0.005), np.log(5.0), (len(QUANTITIES), cells, JOINT_COUNT)))
    lengths[:, ::10] = np.nan
    shares = random.random((len(QUANTITIES), cells, JOINT_COUNT))
    made = {name: shares[i] if name in SHARES else lengths[i] for i, name in enumerate(QUANTITIES)}
    return {name: values.astype(np.float32) for name, values in made.items()}


def table(
    values: Mapping[Quantity, float | np.ndarray], certainty: Certainty = "quality", places: int = 1
) -> GridTable:
    """A table of one environment whose quantities are the same everywhere, or (1, 361, 18)."""
    shape = (1, CELLS, JOINT_COUNT)
    return GridTable(
        recipe=recipe(certainty),
        places=(train_place(),),
        truth=np.zeros((1, JOINT_COUNT, 3), np.float32),
        quantities={name: np.broadcast_to(np.asarray(value, np.float32), shape) for name, value in values.items()},
    )
