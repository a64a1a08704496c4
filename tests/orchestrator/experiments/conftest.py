from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest

from orchestrator.experiments.columns import LIFTINGS, SCHEMA, table_of
from protocol.arrays import AnyArray


def frame(
    number: int, noise: str, random: np.random.Generator, *, calibrated: bool
) -> tuple[dict, dict[str, AnyArray]]:
    """One made-up frame: errors of joints follow 1 - quality, every fifth joint is not located."""
    uncertainty = random.uniform(0.05, 0.9, size=18)
    error = uncertainty * random.uniform(0.5, 1.5, size=18)
    located = random.random(18) > 0.2
    truth = random.normal(size=(18, 3))
    points = np.where(located[:, None], truth + error[:, None] * (0.0, 0.6, 0.8), np.nan)
    own = {
        "frame": number,
        "seed": 7 * number,
        "identity": 40 + number % 4,
        "pose": number % 8,
        "poses": "kinds",
        "distance": 1.5 + 7.5 * random.random(),
        "azimuth": random.uniform(-180, 180),
        "altitude": 1.6,
        "depth_noise": noise,
        "network": "net",
        "lifting": "nearest",
        **dict.fromkeys(("camera_x", "camera_y", "camera_z", "target_x", "target_y", "target_z"), 0.0),
    }
    joints: dict[str, AnyArray] = {name: np.zeros(18) for name in SCHEMA.names if name not in own}
    joints |= {
        "joint": np.arange(18),
        "visible": located,
        "detected": located,
        "located": located,
        "expected_error": np.where(located & calibrated, uncertainty, np.nan),
        "radius": np.where(located & calibrated, 1.4 * uncertainty, np.nan),
    }
    for lifting in ("", *(f"_{one}" for one in LIFTINGS)):
        joints |= {f"{axis}{lifting}": points[:, index] for index, axis in enumerate("xyz")}
        joints[f"error{lifting}"] = np.where(located, error, np.nan)
        joints[f"quality{lifting}"] = np.where(located, 1 - uncertainty, 0.0)
    joints |= {f"true_{axis}": truth[:, index] for index, axis in enumerate("xyz")}
    return own, joints


@pytest.fixture(scope="session")
def made_up_table() -> Callable[..., pa.Table]:
    """A table of made-up frames of four people."""

    def make(frames: int = 60, *, calibrated: bool = True) -> pa.Table:
        random = np.random.default_rng(0)
        noises = ("none", "d435i")
        rows = [frame(number, noise, random, calibrated=calibrated) for number in range(frames) for noise in noises]
        return table_of(rows)

    return make
