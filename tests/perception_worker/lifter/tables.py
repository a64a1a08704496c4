"""Tables as `orchestrator lifter fit` writes them, of bodies that are seen without any picture."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from orchestrator.lifter.table import table_of
from orchestrator.run.config_toml import plain_toml
from protocol.camera import Camera, CameraPose, project
from protocol.config import RunConfig
from tests.perception_worker.lifter.bodies import INTRINSICS, joints


def write_table(path: Path, frames: int = 1200, people: int = 10, seed: int = 0, aside: float = 0.0) -> Path:
    """People of several sizes, each with depths a little before the joints and some joints not found.

    Args:
        aside: pixels by which the keypoints of every other frame are beside the person.
    """
    random = np.random.default_rng(seed)
    rows = [_row(number, number % people, random, aside * (number % 2)) for number in range(frames)]
    table = table_of(rows).replace_schema_metadata(
        {"vantage.config": plain_toml(RunConfig()).decode(), "vantage.views": '{"seed":0}'}
    )
    pq.write_table(table, path)
    return path


def _row(number: int, identity: int, random: np.random.Generator, aside: float) -> dict[str, object]:
    truth = joints() * (0.9 + 0.02 * identity) + random.normal(0.0, 0.05, (18, 3))
    bearing, distance = random.uniform(-np.pi, np.pi), random.uniform(2.0, 6.0)
    position = (distance * np.cos(bearing), distance * np.sin(bearing), random.uniform(1.0, 2.0))
    camera = Camera(CameraPose(position, (0.0, 0.0, 1.0)), INTRINSICS)
    seen = project(truth, camera)
    found = random.random(18) < 0.85
    depths = np.where(found, seen[:, 2], np.nan)[:, None] - 0.08 + np.linspace(-0.03, 0.03, 6)
    evidence = np.concatenate([found[:, None].astype(float), depths], axis=1)
    return {
        "view": number,
        "identity": identity,
        "poses": ("wide", "kinds", "kinds")[number % 3],
        "depth_noise": "none",
        "accompanied": False,
        "hidden": number % 7 == 0,
        "known": True,
        "distance": distance,
        "intrinsics": (INTRINSICS.fx, INTRINSICS.fy, INTRINSICS.cx, INTRINSICS.cy),
        "pose": (*position, 0.0, 0.0, 1.0),
        "keypoints": np.where(found[:, None], seen[:, :2] + aside, np.nan).ravel(),
        "height": np.where(found, 0.8, 0.0),
        "narrow": evidence.ravel(),
        "wide": evidence.ravel(),
        "joints": truth.ravel(),
        "visible": found,
    }
