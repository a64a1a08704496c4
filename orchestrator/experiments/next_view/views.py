"""Scenes that nine cameras in a 3×3 array see at the same time (thesis, section 4.2).

A scene depends only on the set's seed, its split and the scenes before it in its part, not on how many follow.
"""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from orchestrator.experiments.views import View, ViewSet, view
from orchestrator.pictures.view import Viewpoint, camera_at, camera_from
from protocol.camera import Camera
from protocol.environment_config import EnvironmentConfig
from protocol.errors import InvalidInput
from protocol.scene import Scene, Split

CELLS: tuple[tuple[int, int], ...] = tuple((column, row) for row in (1, 0, -1) for column in (-1, 0, 1))
"""Column and row of each camera, as seen from behind the array: -1 is left or below, 1 right or above."""

CENTRE = CELLS.index((0, 0))

DISTANCE = (2.0, 7.0)
AZIMUTH = (-180.0, 180.0)
ALTITUDE = (1.5, 2.5)
"""What the centre's viewpoint is drawn from, evenly: metres along the ground, degrees from the front, metres above the
ground."""

SPACING = 1.0
"""Metres from a camera to the next one of its row or column: the side of the thesis's grid cells (section 4.3.4)."""

_PLACE = 0xA44A
"""Separates the random stream of an array's place from that of its scene."""


class ArrayViews(Struct, frozen=True, kw_only=True):
    """All the views of the experiment.

    Attributes:
        train, test: number of scenes of each split.
        seed: the scenes and the places of their arrays follow from it.
        spacing: of the cameras, metres.
        scenes_a_part: how many are written at once; a kill loses at most these.
    """

    train: int = 1024
    test: int = 256
    seed: int = 0
    spacing: float = SPACING
    scenes_a_part: int = 32

    def __post_init__(self) -> None:
        if min(self.train, self.test, self.scenes_a_part) < 1 or self.seed < 0:
            raise InvalidInput("the experiment has 1 scene or more of each split, and a seed of 0 or more")
        if not 0 < self.spacing < ALTITUDE[0]:
            raise InvalidInput(
                f"cameras can't be {self.spacing} m apart: with {ALTITUDE[0]:g} m or more the lowest would be in the "
                "ground"
            )

    @property
    def count(self) -> int:
        """The number of views."""
        return len(CELLS) * (self.train + self.test)

    @property
    def words(self) -> str:
        """A description of the views, for messages."""
        each = f"{self.spacing:g} m apart, {self.scenes_a_part} scenes a part"
        return f"{self.train} train and {self.test} test scenes, seed {self.seed}, cameras {each}"

    @property
    def parts(self) -> tuple["ArrayPart", ...]:
        """The parts of the table, those of the test split first: with them, any part of the others says something."""
        counts: dict[Split, int] = {"test": self.test, "train": self.train}
        return tuple(
            ArrayPart(split=split, scenes=range(first, min(first + self.scenes_a_part, count)))
            for split, count in counts.items()
            for first in range(0, count, self.scenes_a_part)
        )


class ArrayPart(Struct, frozen=True, kw_only=True):
    """Some scenes of a split, by their numbers in there."""

    split: Split
    scenes: range


def scene_views(views: ArrayViews, part: ArrayPart) -> tuple[ViewSet, Sequence[View]]:
    """The first view of each scene, and the set that `scenes_of` draws their scenes of.

    Both splits draw from seeds of their own: the same seed would give people of both the same clothes and surroundings.
    """
    drawn = ViewSet(
        frames=len(CELLS) * part.scenes.stop,
        split=part.split,
        seed=2 * views.seed + (part.split == "test"),
        views_a_scene=len(CELLS),
        frames_a_part=len(CELLS) * views.scenes_a_part,
    )
    return drawn, [view(drawn, len(CELLS) * scene) for scene in part.scenes]


def centre_of(views: ArrayViews, split: Split, scene: int) -> Viewpoint:
    """The viewpoint of the array's centre."""
    random = np.random.default_rng((views.seed, split == "test", scene, _PLACE))
    distance, azimuth, altitude = (float(random.uniform(*bounds)) for bounds in (DISTANCE, AZIMUTH, ALTITUDE))
    return Viewpoint(distance=distance, angle=azimuth, altitude=altitude)


def array_cameras(
    centre: Viewpoint, spacing: float, scene: Scene, environment: EnvironmentConfig
) -> tuple[Camera, ...]:
    """The cameras of `CELLS`, each turned to the person.

    The array is an upright plane that faces the person.
    """
    x, y, z = camera_at(centre, scene, environment).pose.position
    bearing = scene.yaw + math.radians(centre.angle)
    # The camera heads against the bearing, and a quarter turn clockwise from there is its right.
    right_x, right_y = -math.sin(bearing), math.cos(bearing)
    return tuple(
        camera_from(
            (x + column * spacing * right_x, y + column * spacing * right_y, z + row * spacing), scene, environment
        )
        for column, row in CELLS
    )
