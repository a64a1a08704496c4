"""A grid table without renders: certainty falls with the distance from a point in front of the person."""

from pathlib import Path

import numpy as np

from protocol.grid.table import CELLS, SIDE, GridPlace, GridRecipe, GridTable, stored_place, write_table
from protocol.skeleton import JOINT_COUNT

RECIPE = GridRecipe(certainty="quality", version="test", config="", views="{}", perception={}, packages={})


def table(train: int = 4, test: int = 2, seed: int = 0) -> GridTable:
    """A table of so many environments; the person faces a yaw of its own in each."""
    random = np.random.default_rng(seed)
    yaws = random.uniform(-np.pi, np.pi, train + test)
    places = tuple(
        GridPlace(
            split="train" if number < train else "test",
            seed=number,
            identity=number % 40 if number < train else 40 + number % 20,
            pose=number % 6,
            yaw=float(yaw),
        )
        for number, yaw in enumerate(yaws)
    )
    quality = np.stack([quality_around(yaw) for yaw in yaws])
    names = ("mass", "height", "distance")
    return GridTable(
        recipe=RECIPE,
        places=places,
        truth=np.zeros((train + test, JOINT_COUNT, 3), np.float32),
        quantities=dict.fromkeys(names, quality),
    )


def quality_around(yaw: float) -> np.ndarray:
    """(361, 18) quality 1 at three metres in front, less by 0.15 a metre from there."""
    cells = np.arange(CELLS)
    positions = np.stack([cells % SIDE, cells // SIDE], axis=1) - SIDE // 2
    best = 3.0 * np.array([np.cos(yaw), np.sin(yaw)])
    quality = np.clip(1.0 - 0.15 * np.linalg.norm(positions - best, axis=1), 0.0, 1.0)
    return np.repeat(quality[:, None], JOINT_COUNT, axis=1).astype(np.float32)


def write_to(path: Path, views: GridTable) -> Path:
    """The table's file."""
    places = [
        stored_place(place, views.truth[number], {name: values[number] for name, values in views.quantities.items()})
        for number, place in enumerate(views.places)
    ]
    write_table(path, views.recipe, tuple(views.quantities), places)
    return path
