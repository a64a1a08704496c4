"""The surroundings of the person: grounds, skies and halls, by their names in a scene.

The lists of names are fixed: the same seed gives the same scene on every machine. A drone flies within 9 m of the
origin, so a hall's walls stand beyond that.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from protocol.arrays import Float32Array, UInt8Array
from protocol.errors import InvalidInput
from render_worker.arrays import IndexArray, RealArray
from render_worker.noise import seamless_noise
from render_worker.surroundings.skies import SKIES
from render_worker.surroundings.walls import WALLS

GROUNDS = ("grass", "gravel", "pavers", "tiles", "concrete", "boards", "asphalt", "carpet")
BACKGROUNDS = (
    "sky-clear",
    "sky-clouds",
    "sky-overcast",
    "sky-evening",
    "sky-town",
    "sky-forest",
    "hall-plaster",
    "hall-brick",
    "hall-panels",
    "hall-windows",
)

HALL_HALF_WIDTH = 14.0
HALL_HEIGHT = 5.5

_SKY_RADIUS = 60.0
_SIZE = 512


class Ground(NamedTuple):
    """A seamless image (size, size, 3) that is `extent` metres wide on the ground."""

    image: UInt8Array
    extent: float


class Shell(NamedTuple):
    """A textured surface that surrounds the scene.

    Attributes:
        corners: (c, 7) float32: position, texture coordinates, shade and haze.
        triangles: (t, 3).
        image: (height, width, 3) sRGB.
        solid: whether it is at its distance; a sky is at none.
    """

    corners: Float32Array
    triangles: IndexArray
    image: UInt8Array
    solid: bool


def require_names(ground: str, background: str) -> None:
    """Check that a scene's images are known.

    Raises:
        InvalidInput: one is not; the message lists those that are.
    """
    for kind, name, known in (("ground", ground, GROUNDS), ("background", background, BACKGROUNDS)):
        if name not in known:
            raise InvalidInput(f"there is no {kind} '{name}'; there are {', '.join(known)}")


def is_hall(background: str) -> bool:
    """Whether the scene is under a roof."""
    return background.startswith("hall-")


def make_ground(name: str, photographs: Mapping[str, UInt8Array]) -> Ground:
    """The ground of a name."""
    return _GROUND_MAKERS[name](photographs)


def make_shells(background: str, photographs: Mapping[str, UInt8Array]) -> tuple[Shell, ...]:
    """The surfaces around the ground: a sky, or walls and a ceiling."""
    if not is_hall(background):
        corners, triangles = _dome()
        return (Shell(corners, triangles, SKIES[background](), solid=False),)
    wall, ceiling = WALLS[background](photographs)
    return Shell(*_walls(), wall, solid=True), Shell(*_ceiling(), ceiling, solid=True)


def ground_bands(
    centre: tuple[float, float], patch: float, extent: float, shade: float, *, hall: bool
) -> tuple[Float32Array, IndexArray]:
    """The ground outside a square patch: nested squares, the haze growing outwards where there is no hall.

    Args:
        centre, patch: of the square that is left out, and half its width, metres.
        extent: of the ground's image, metres.
        shade: light on the ground.

    Returns:
        (c, 7) corners as a `Shell`'s, and (t, 3) triangles.
    """
    radii = [patch, HALL_HALF_WIDTH] if hall else [patch, 9.0, 22.0, _SKY_RADIUS]
    hazes = [0.0, 0.0] if hall else [0.0, 0.04, 0.25, 0.8]
    corners: list[list[float]] = []
    for number, (radius, haze) in enumerate(zip(radii, hazes, strict=True)):
        x, y = centre if number == 0 else (0.0, 0.0)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            px, py = x + sx * radius, y + sy * radius
            corners.append([px, py, 0.0, px / extent, py / extent, shade, haze])
    triangles: list[list[int]] = []
    for band in range(len(radii) - 1):
        inner, outer = 4 * band, 4 * band + 4
        for k in range(4):
            a, b, c, d = inner + k, inner + (k + 1) % 4, outer + (k + 1) % 4, outer + k
            triangles += [[a, d, c], [a, c, b]]
    return np.array(corners, np.float32), np.array(triangles, np.int32)


def ground_patch(centre: tuple[float, float], half: float, extent: float) -> tuple[Float32Array, IndexArray]:
    """The square of ground that the person's shadow falls on: (4, 5) position and texture coordinates, (2, 3)."""
    x, y = centre
    places = [(x + sx * half, y + sy * half) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    corners = [[px, py, 0.0, px / extent, py / extent] for px, py in places]
    return np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def _dome() -> tuple[Float32Array, IndexArray]:
    """A sphere's upper part around the origin, seen from inside, from a little below the horizon."""
    columns, rows = 64, 24
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    azimuth, elevation = 2 * np.pi * u, np.radians(-5 + 95 * v)
    level = _SKY_RADIUS * np.cos(elevation)
    position = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), _SKY_RADIUS * np.sin(elevation)], axis=-1)
    lit = np.stack([u, v, np.ones_like(u), np.zeros_like(u)], axis=-1)
    corners = np.concatenate([position, lit], axis=-1).reshape(-1, 7).astype(np.float32)
    return corners, _grid_triangles(columns, rows)


def _grid_triangles(columns: int, rows: int) -> IndexArray:
    row, column = np.divmod(np.arange(columns * rows), columns)
    a = row * (columns + 1) + column
    b, c, d = a + 1, a + columns + 2, a + columns + 1
    return np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)]).astype(np.int32)


def _walls() -> tuple[Float32Array, IndexArray]:
    corners: list[list[float]] = []
    repeats = 2 * HALL_HALF_WIDTH / (HALL_HEIGHT * 2)
    for k, shade in enumerate((0.95, 0.85, 1.0, 0.9)):
        cosine, sine = round(np.cos(k * np.pi / 2)), round(np.sin(k * np.pi / 2))
        for side, height in ((-1, 0), (1, 0), (1, 1), (-1, 1)):
            x, y = HALL_HALF_WIDTH, side * HALL_HALF_WIDTH
            place = [cosine * x - sine * y, sine * x + cosine * y, height * HALL_HEIGHT]
            corners.append([*place, -side * repeats / 2, height, shade * (0.82 + 0.18 * height), 0.0])
    triangles = [[4 * k + a, 4 * k + b, 4 * k + c] for k in range(4) for a, b, c in ((0, 2, 1), (0, 3, 2))]
    return np.array(corners, np.float32), np.array(triangles, np.int32)


def _ceiling() -> tuple[Float32Array, IndexArray]:
    half = HALL_HALF_WIDTH
    corners = [
        [sx * half, sy * half, HALL_HEIGHT, sx * 3, sy * 3, 0.92, 0] for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return np.array(corners, np.float32), np.array([[0, 2, 1], [0, 3, 2]], np.int32)


def _tinted(photograph: UInt8Array, colour: tuple[int, int, int], contrast: float) -> UInt8Array:
    """A grey photograph in a colour, its own shading kept to a share of it."""
    grey = photograph.mean(axis=2)
    shading = 1 + contrast * (grey / grey.mean() - 1)
    return np.clip(shading[..., None] * np.array(colour), 0, 255).astype(np.uint8)


def _joints(size: int, count: int, width: int, depth: float) -> Float32Array:
    """(size, size) darkening of the grooves between square plates."""
    groove = (np.arange(size) % (size // count)) < width
    return np.where(groove[:, None] | groove[None], 1 - depth, 1.0).astype(np.float32)


def _mottled(colour: tuple[int, int, int], *layers: tuple[float, float, float, int]) -> RealArray:
    """A colour under layers of noise: strength, roughness, stretch and seed of each."""
    shading = sum(strength * seamless_noise(_SIZE, rough, stretch, seed) for strength, rough, stretch, seed in layers)
    return np.array(colour, np.float32) * (1 + np.asarray(shading)[..., None])


def _image(values: RealArray) -> UInt8Array:
    return np.clip(values, 0, 255).astype(np.uint8)


def _tiles() -> Ground:
    return Ground(_image(_mottled((172, 166, 156), (0.03, 1.2, 1, 41)) * _joints(_SIZE, 4, 4, 0.25)[..., None]), 2.4)


def _boards() -> Ground:
    rows = np.arange(_SIZE) // 64
    tone = 1 + 0.12 * np.random.default_rng(43).standard_normal(8)[rows]
    seam = np.where(np.arange(_SIZE) % 64 < 2, 0.6, 1.0)
    grain = _mottled((148, 112, 78), (0.09, 0.9, 8, 42))
    return Ground(_image(grain * (tone * seam)[:, None, None]), 1.6)


_GROUND_MAKERS: dict[str, Callable[[Mapping[str, UInt8Array]], Ground]] = {
    "grass": lambda photographs: Ground(_tinted(photographs["grass"], (98, 118, 62), 0.6), 2.5),
    "gravel": lambda photographs: Ground(_tinted(photographs["gravel"], (140, 132, 120), 0.6), 2.0),
    "pavers": lambda photographs: Ground(_tinted(photographs["brick"], (150, 122, 106), 0.8), 3.0),
    "tiles": lambda _: _tiles(),
    "concrete": lambda _: Ground(_image(_mottled((150, 148, 144), (0.06, 1.4, 1, 44), (0.03, 0.2, 1, 45))), 5.0),
    "boards": lambda _: _boards(),
    "asphalt": lambda _: Ground(_image(_mottled((92, 92, 95), (0.05, 1.3, 1, 46), (0.10, 0.2, 1, 47))), 3.0),
    "carpet": lambda _: Ground(_image(_mottled((104, 92, 112), (0.04, 1.5, 1, 48), (0.06, 0.1, 1, 49))), 4.0),
}
