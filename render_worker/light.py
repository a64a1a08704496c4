"""The light of a scene: the sun or lamp, the sky, and where the sun looks from. Colours are linear."""

import math
from typing import NamedTuple

import numpy as np

from protocol.arrays import Float64Array
from protocol.camera import Vector3
from protocol.scene import Scene
from render_worker.surroundings import is_hall

SHADOW_REACH = 3.2
"""Metres around the person in which their shadow falls."""

_PERSON_RADIUS = 1.25
"""Metres around the middle of the body that hold all of it, arms raised."""

_MIDDLE = 0.95


class Light(NamedTuple):
    """What shines on a scene.

    Attributes:
        view: (4, 4) world to the sun's clip space.
        towards_sun: unit vector.
        sun, sky, bounce: light from the sun, from above and from the ground.
        air: colour of the haze.
        lit_shade, shadow_shade: factors on the ground's sRGB image in the sun and out of it.
    """

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
    return Light(
        view=light_view(towards, (scene.position[0], scene.position[1], _MIDDLE)),
        towards_sun=towards,
        sun=(1.0 * direct, 0.96 * direct, 0.88 * direct),
        sky=(0.95 * ambient, 1.0 * ambient, 1.08 * ambient),
        bounce=(0.62 * ambient, 0.57 * ambient, 0.5 * ambient),
        air=(0.78, 0.83, 0.88),
        lit_shade=math.sqrt(ambient + direct * math.sin(elevation)) * 0.92,
        shadow_shade=math.sqrt(ambient * 0.8) * 0.92,
    )


def light_view(towards_sun: Vector3, middle: Vector3) -> Float64Array:
    """(4, 4) parallel projection along the sun's rays of the ball that holds the person."""
    back = np.asarray(towards_sun)
    right = np.cross((0.0, 0.0, 1.0), back)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([1.0, 0.0, 0.0])
    axes = np.stack([right, np.cross(back, right), -back]) / _PERSON_RADIUS
    # The ground that takes the shadow lies behind the ball, seen from the sun.
    axes[2] /= 4
    view = np.eye(4)
    view[:3, :3] = axes
    view[:3, 3] = -axes @ np.asarray(middle)
    return view
