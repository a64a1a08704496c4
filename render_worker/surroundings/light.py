"""The light of a scene: the sun or lamp, the sky, and where the sun looks from. Colours are linear."""

import math
from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.camera import Vector3
from protocol.scene import Scene
from render_worker.surroundings.surroundings import is_hall

_SHADOW_REACH = 3.2
"""Metres around a person in which their shadow falls."""

_PERSON_RADIUS = 1.25
"""Metres around the middle of the body that hold all of it, arms raised."""

_MIDDLE = 0.95

_WIDEST = 5.0
"""Metres from the middle of the people within which shadows fall; the ground around is made for no more."""


class Light(NamedTuple):
    """The light of a scene.

    Attributes:
        centre: of the people, on the ground, world x and y in metres.
        reach: metres around the centre in which their shadows fall.
        view: (4, 4) world to the sun's clip space.
        towards_sun: unit vector.
        sun, sky, bounce: light from the sun, from above and from the ground.
        air: colour of the haze.
        lit_shade, shadow_shade: factors on the ground's sRGB image in the sun and out of it.
    """

    centre: tuple[float, float]
    reach: float
    view: Float64Array
    towards_sun: Vector3
    sun: Vector3
    sky: Vector3
    bounce: Vector3
    air: Vector3
    lit_shade: float
    shadow_shade: float


def light_of(scene: Scene) -> Light:
    """The light that a scene's sun and surroundings make."""
    azimuth, elevation, strength = scene.sun.azimuth, scene.sun.elevation, scene.sun.strength
    level = math.cos(elevation)
    towards: Vector3 = (level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation))
    hall = is_hall(scene.background)
    direct = strength * (0.6 if hall else 1.0)
    ambient = 0.62 if hall else 0.5
    centre, spread = _gathering(scene)
    return Light(
        centre=centre,
        reach=_SHADOW_REACH + spread,
        view=light_view(towards, (*centre, _MIDDLE), _PERSON_RADIUS + spread),
        towards_sun=towards,
        sun=(1.0 * direct, 0.96 * direct, 0.88 * direct),
        sky=(0.95 * ambient, 1.0 * ambient, 1.08 * ambient),
        bounce=(0.62 * ambient, 0.57 * ambient, 0.5 * ambient),
        air=(0.78, 0.83, 0.88),
        lit_shade=math.sqrt(ambient + direct * math.sin(elevation)) * 0.92,
        shadow_shade=math.sqrt(ambient * 0.8) * 0.92,
    )


def _gathering(scene: Scene) -> tuple[tuple[float, float], float]:
    """The middle of the people on the ground, and how far from it they stand; a person alone is the middle."""
    places = [scene.position, *(one.position for one in scene.bystanders)]
    (left, right), (near, far) = ((min(values), max(values)) for values in zip(*places, strict=True))
    # Half of a sum of two equal numbers is that number, to the bit.
    centre = (left + right) / 2, (near + far) / 2
    return centre, min(max(math.dist(centre, place) for place in places), _WIDEST)


def light_view(towards_sun: Vector3, middle: Vector3, radius: float = _PERSON_RADIUS) -> Float64Array:
    """(4, 4) parallel projection along the sun's rays of the ball that holds the people."""
    back = np.asarray(towards_sun)
    right = np.cross((0.0, 0.0, 1.0), back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([1.0, 0.0, 0.0])
    axes = np.stack([right, np.cross(back, right), -back]) / radius
    # The ground that takes the shadow lies behind the ball, seen from the sun.
    axes[2] /= 4
    view = np.eye(4)
    view[:3, :3] = axes
    view[:3, 3] = -axes @ np.asarray(middle)
    return view
