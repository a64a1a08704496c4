"""Scenes drawn from a seed. The same seed and split give the same scene on every worker."""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from protocol.scene import TEST_IDENTITIES, TEST_POSES, TRAIN_IDENTITIES, TRAIN_POSES, Scene, Split, Sun
from render_worker.poses import sample_pose
from render_worker.surroundings import BACKGROUNDS, is_hall

FARTHEST_FROM_ORIGIN = 0.5

_OUTDOOR = ("grass", "gravel", "pavers", "concrete", "asphalt")
_INDOOR = ("tiles", "concrete", "boards", "carpet")

_Choice = TypeVar("_Choice")


def sample_scene(seed: int, split: Split) -> Scene:
    """Draw a scene: who, in what pose, dressed how, where, and under what light.

    Train scenes have identities 0 to 39 in poses 0 to 5; test scenes identities 40 to 59 in poses 0 to 7.
    """
    random = np.random.default_rng([abs(seed), int(seed < 0), 0 if split == "train" else 1])
    identities, kinds = (TRAIN_IDENTITIES, TRAIN_POSES) if split == "train" else (TEST_IDENTITIES, TEST_POSES)
    identity, kind = _choose(random, identities), _choose(random, kinds)
    background = _choose(random, BACKGROUNDS)
    distance, direction = FARTHEST_FROM_ORIGIN * np.sqrt(random.random()), random.uniform(-np.pi, np.pi)
    return Scene(
        identity=identity,
        pose=sample_pose(kind, random),
        appearance=int(random.integers(2**32)),
        position=(float(distance * np.cos(direction)), float(distance * np.sin(direction))),
        yaw=float(random.uniform(-np.pi, np.pi)),
        sun=_sun(random),
        ground=_choose(random, _INDOOR if is_hall(background) else _OUTDOOR),
        background=background,
    )


def _choose(random: np.random.Generator, choices: Sequence[_Choice]) -> _Choice:
    return choices[int(random.integers(len(choices)))]


def _sun(random: np.random.Generator) -> Sun:
    return Sun(
        azimuth=float(random.uniform(-np.pi, np.pi)),
        elevation=float(np.radians(random.uniform(38, 70))),
        strength=float(random.uniform(0.6, 1.1)),
    )
