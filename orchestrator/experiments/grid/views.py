"""The environments of a grid table, and the cameras of their cells (thesis, section 4.3.4).

An environment depends only on the set's seed, its split and its turn in there, not on how many there are.
"""

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from orchestrator.experiments.views import identities_and_poses
from orchestrator.pictures.view import Viewpoint, camera_at, camera_from
from protocol.camera import Camera
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.grid.table import CELLS, CENTRE, SIDE, GridPlace
from protocol.messages import SampleScene
from protocol.scene import Scene, Split

ALTITUDE = 1.6
"""Metres above the ground, of every camera."""

OBSERVED_CELLS = tuple(cell for cell in range(CELLS) if cell != CENTRE)
"""The cells with a view. In the centre the camera would be inside the person."""

GLANCE_DISTANCE = 3.0
GLANCE_ANGLES = (0.0, 30.0, -30.0, 60.0, -60.0, 90.0, -90.0, 135.0, -135.0, 180.0)
"""Metres from the person and degrees from their front: where the first picture is taken, and the next ones while the
person is not found."""


class GridViews(Struct, frozen=True, kw_only=True):
    """All the views of a grid table.

    Attributes:
        train, test: number of environments of each split.
        seed: the environments follow from it.
        altitude: of every camera, metres above the ground.
    """

    train: int = 80
    test: int = 40
    seed: int = 0
    altitude: float = ALTITUDE

    def __post_init__(self) -> None:
        if min(self.train, self.test) < 1 or self.seed < 0:
            raise InvalidInput("a grid table has 1 environment or more of each split, and a seed of 0 or more")

    @property
    def count(self) -> int:
        """The number of environments."""
        return self.train + self.test

    @property
    def words(self) -> str:
        """A description of the views, for messages."""
        return f"{self.train} train and {self.test} test environments, seed {self.seed}, {self.altitude:g} m high"


class Subject(Struct, frozen=True, kw_only=True):
    """Who is seen in an environment.

    Attributes:
        turn: number of the environment in its split, from 0.
        identity: the person's.
        kind: of the person's pose.
    """

    split: Split
    turn: int
    identity: int
    kind: int


def subject_of(views: GridViews, number: int) -> Subject:
    """The subject of environment `number`, of which those of the train split come first.

    Identities and poses are used in turn, each as often as any other or once more. Whenever both begin again together,
    the poses are one further, so that in the end every identity is seen in every pose.
    """
    split: Split = "train" if number < views.train else "test"
    turn = number if split == "train" else number - views.train
    identities, kinds = identities_and_poses(split)
    rounds = turn // math.lcm(len(identities), len(kinds))
    return Subject(
        split=split,
        turn=turn,
        identity=identities[turn % len(identities)],
        kind=kinds[(turn + rounds) % len(kinds)],
    )


def draws_of(views: GridViews, subject: Subject) -> Iterator[SampleScene]:
    """Requests for scenes, without end; the first scene with a pose of the subject's kind is the environment's."""
    random = np.random.default_rng((views.seed, subject.split == "test", subject.turn))
    while True:
        yield SampleScene(seed=int(random.integers(2**31)), split=subject.split)


def with_identity(drawn: Scene, subject: Subject) -> Scene:
    """A drawn scene with the subject's body in place of its own."""
    return replace(drawn, identity=subject.identity)


def place_of(subject: Subject, seed: int, scene: Scene) -> GridPlace:
    """What a table says of an environment whose scene was drawn from a seed."""
    return GridPlace(
        split=subject.split, seed=seed, identity=scene.identity, pose=scene.pose.kind, yaw=float(scene.yaw)
    )


def camera_in(cell: int, views: GridViews, scene: Scene, environment: EnvironmentConfig) -> Camera:
    """The camera in the centre of a cell, turned to the person.

    The grid's axes are the world's, and the centre of its middle cell is the person's place.
    """
    row, column = divmod(cell, SIDE)
    x, y = scene.position
    return camera_from((x + column - SIDE // 2, y + row - SIDE // 2, views.altitude), scene, environment)


def glance_camera(angle: float, views: GridViews, scene: Scene, environment: EnvironmentConfig) -> Camera:
    """The camera of a glance, by which a filter gets to know the person; degrees from the person's front."""
    return camera_at(Viewpoint(distance=GLANCE_DISTANCE, angle=angle, altitude=views.altitude), scene, environment)
