from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest

from orchestrator.experiments.figures.columns import LIFTINGS, SCHEMA, table_of
from protocol.arrays import AnyArray


def frame(
    number: int, noise: str, random: np.random.Generator, *, calibrated: bool, lifting: str, poses: str
) -> tuple[dict, dict[str, AnyArray]]:
    """One made-up frame: errors of joints follow 1 - quality, every fifth joint is not detected.

    What is not detected is located by a learned lifter alone. It is off by a third of the surface's error.
    """
    uncertainty = random.uniform(0.05, 0.9, size=18)
    error = uncertainty * random.uniform(0.5, 1.5, size=18)
    located = random.random(18) > 0.2
    truth = random.normal(size=(18, 3))
    points = np.where(located[:, None], truth + error[:, None] * (0.0, 0.6, 0.8), np.nan)
    learned = lifting == "learned"
    own_points = truth + error[:, None] / 3 * (0.0, 0.6, 0.8) if learned else points
    own_error = error / 3 if learned else np.where(located, error, np.nan)
    own = {
        "frame": number,
        "seed": 7 * number,
        "identity": 40 + number % 4,
        "pose": number % 8,
        "poses": poses,
        "distance": 1.5 + 7.5 * random.random(),
        "azimuth": random.uniform(-180, 180),
        "altitude": 1.6,
        "depth_noise": noise,
        "network": "net",
        "lifting": lifting,
        **dict.fromkeys(("camera_x", "camera_y", "camera_z", "target_x", "target_y", "target_z"), 0.0),
    }
    joints: dict[str, AnyArray] = {name: np.zeros(18) for name in SCHEMA.names if name not in own}
    joints |= {
        "joint": np.arange(18),
        "visible": located,
        "detected": located,
        "located": located | learned,
        "expected_error": np.where((located | learned) & calibrated, uncertainty, np.nan) / (3 if learned else 1),
        "radius": np.where((located | learned) & calibrated, 1.4 * uncertainty, np.nan) / (3 if learned else 1),
        "error": own_error,
        "quality": np.where(located, 1 - uncertainty, 0.0),
    }
    for reading in LIFTINGS:
        joints |= {f"{axis}_{reading}": points[:, index] for index, axis in enumerate("xyz")}
        joints[f"error_{reading}"] = np.where(located, error, np.nan)
        joints[f"quality_{reading}"] = np.where(located, 1 - uncertainty, 0.0)
    joints |= {axis: own_points[:, index] for index, axis in enumerate("xyz")}
    joints |= {f"true_{axis}": truth[:, index] for index, axis in enumerate("xyz")}
    return own, joints


@pytest.fixture(scope="session")
def made_up_table() -> Callable[..., pa.Table]:
    """A table of made-up frames of four people, in the eight kinds of pose or in families."""

    def make(
        frames: int = 60, *, calibrated: bool = True, lifting: str = "nearest", families: tuple[str, ...] = ("kinds",)
    ) -> pa.Table:
        random = np.random.default_rng(0)
        options = {"calibrated": calibrated, "lifting": lifting}
        rows = [
            frame(number, noise, random, **options, poses=families[number % len(families)])
            for number in range(frames)
            for noise in ("none", "d435i")
        ]
        return table_of(rows)

    return make
