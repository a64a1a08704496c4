"""Scenes drawn from a seed. The same seed and split give the same scene on every worker."""

import math
from collections.abc import Sequence
from typing import Literal, TypeVar, get_args

import numpy as np
from msgspec.structs import replace

from protocol.errors import InvalidInput
from protocol.scene import (
    MOST_BYSTANDERS,
    TEST_IDENTITIES,
    TEST_POSES,
    TRAIN_IDENTITIES,
    TRAIN_POSES,
    BodyPose,
    Figure,
    Poses,
    Scene,
    Split,
    Sun,
)
from render_worker.people.pose_families import Family, sample_family
from render_worker.people.poses import sample_pose
from render_worker.people.wide_poses import sample_wide_pose
from render_worker.surroundings.surroundings import BACKGROUNDS, is_hall

FARTHEST_FROM_ORIGIN = 0.5

NEAREST_BYSTANDER, FARTHEST_BYSTANDER = 0.8, 3.0
"""Metres from the person: seldom out of the picture that shows the person. No two people stand nearer to each other."""

_OUTDOOR = ("grass", "gravel", "pavers", "concrete", "asphalt")
_INDOOR = ("tiles", "concrete", "boards", "carpet")

_OF_SPLIT: dict[Split, tuple[range, range]] = {
    "train": (TRAIN_IDENTITIES, TRAIN_POSES),
    "test": (TEST_IDENTITIES, TEST_POSES),
}
"""Identities and poses."""

_Choice = TypeVar("_Choice")


def sample_scene(seed: int, split: Split, bystanders: int = 0, poses: Poses = "kinds") -> Scene:
    """Draw a scene: who, in what pose, dressed how, where, and under what light.

    Train scenes have identities 0 to 39 in poses 0 to 5; test scenes identities 40 to 59 in poses 0 to 7. With
    `bystanders`, the same scene has that many people more in it, of the same split. With other `poses`, the person of
    the same scene does something else; bystanders do not.

    Raises:
        InvalidInput: more bystanders than are drawn, or less than none.
    """
    if not 0 <= bystanders <= MOST_BYSTANDERS:
        raise InvalidInput(f"there can be 0 to {MOST_BYSTANDERS} bystanders, not {bystanders}")
    key = [abs(seed), int(seed < 0), 0 if split == "train" else 1]
    scene = _sample_alone(np.random.default_rng(key), split)
    # Randomness of their own: the scene is the one that it is without them, and the first of three is the first of one.
    random = np.random.default_rng([*key, 1])
    people = [scene.person]
    for _ in range(bystanders):
        people.append(_sample_bystander(random, split, people))
    pose = scene.pose if poses == "kinds" else _sample_other(key, poses)
    return replace(scene, pose=pose, bystanders=tuple(people[1:]))


def _sample_other(key: Sequence[int], poses: Literal["wide"] | Family) -> BodyPose:
    random = np.random.default_rng([*key, 2, get_args(Poses).index(poses)])
    return sample_wide_pose(random) if poses == "wide" else sample_family(poses, random)


def _sample_alone(random: np.random.Generator, split: Split) -> Scene:
    identities, kinds = _OF_SPLIT[split]
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


def _sample_bystander(random: np.random.Generator, split: Split, people: Sequence[Figure]) -> Figure:
    identities, kinds = _OF_SPLIT[split]
    taken = {one.identity for one in people}
    return Figure(
        identity=_choose(random, [identity for identity in identities if identity not in taken]),
        pose=sample_pose(_choose(random, kinds), random),
        appearance=int(random.integers(2**32)),
        position=_free_place(random, people),
        yaw=float(random.uniform(-np.pi, np.pi)),
    )


def _free_place(random: np.random.Generator, people: Sequence[Figure]) -> tuple[float, float]:
    """Where a bystander of the first of the people may stand; tried until it is found, and most tries succeed."""
    x, y = people[0].position
    while True:
        distance, direction = random.uniform(NEAREST_BYSTANDER, FARTHEST_BYSTANDER), random.uniform(-np.pi, np.pi)
        place = float(x + distance * np.cos(direction)), float(y + distance * np.sin(direction))
        if all(math.dist(place, one.position) >= NEAREST_BYSTANDER for one in people[1:]):
            return place


def _choose(random: np.random.Generator, choices: Sequence[_Choice]) -> _Choice:
    return choices[int(random.integers(len(choices)))]


def _sun(random: np.random.Generator) -> Sun:
    return Sun(
        azimuth=float(random.uniform(-np.pi, np.pi)),
        elevation=float(np.radians(random.uniform(38, 70))),
        strength=float(random.uniform(0.6, 1.1)),
    )
