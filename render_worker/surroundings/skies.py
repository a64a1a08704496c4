"""Panoramas of sky and horizon: (512, 2048, 3), from 5 degrees below the horizon (first row) up to the zenith."""

from collections.abc import Callable

import numpy as np

from protocol.arrays import UInt8Array
from render_worker.arrays import RealArray
from render_worker.noise import seamless_noise
from render_worker.people.outfit import Colour

ROWS, COLUMNS = 512, 2048

_LOWEST, _HIGHEST = -5.0, 90.0


def _elevation() -> RealArray:
    """(rows, 1) degrees."""
    return np.linspace(_LOWEST, _HIGHEST, ROWS, dtype=np.float32)[:, None]


def _gradient(zenith: Colour, horizon: Colour) -> RealArray:
    share = np.exp(-np.clip(_elevation(), 0, None) / 18)[..., None]
    plain = np.array(zenith, np.float32) * (1 - share) + np.array(horizon, np.float32) * share
    return np.tile(plain, (1, COLUMNS, 1))


def _clouds(sky: RealArray, cover: float, colour: Colour, seed: int) -> RealArray:
    """Clouds, finer towards the horizon; `cover` is the share of the sky under them."""
    noise = seamless_noise(1024, 1.5, 1.0, seed)
    columns = np.arange(COLUMNS)[None] // 2
    depth = 40 / np.tan(np.radians(np.clip(_elevation(), 4, 85)))
    shape = noise[(depth * 4).astype(int) % 1024, np.broadcast_to(columns, (ROWS, COLUMNS)) % 1024]
    amount = np.clip((shape - np.quantile(noise, 1 - cover)) / 0.8, 0, 1) * np.clip(_elevation() / 5, 0, 1)
    return sky + (np.array(colour, np.float32) - sky) * (0.85 * amount)[..., None]


def _ridge(height: float, seed: int, roughness: float) -> RealArray:
    """(columns,) elevation of a skyline in degrees, seamless."""
    random = np.random.default_rng(seed)
    frequency = np.arange(1, 400)
    phase = random.uniform(0, 2 * np.pi, len(frequency))
    angle = np.linspace(0, 2 * np.pi, COLUMNS, endpoint=False)
    waves = np.cos(frequency[:, None] * angle + phase[:, None]) / frequency[:, None] ** roughness
    ridge = waves.sum(axis=0)
    return (height * (1 + 0.45 * ridge / ridge.std())).astype(np.float32)


def _silhouette(sky: RealArray, skyline: RealArray, colour: Colour, texture: float, seed: int) -> RealArray:
    """Everything below a skyline in one colour, a little mottled."""
    mottle = np.tile(seamless_noise(512, 1.0, 1.0, seed), (1, COLUMNS // 512))
    painted = np.array(colour, np.float32) * (1 + texture * mottle)[..., None]
    share = np.clip((skyline[None] - _elevation()) / 0.3, 0, 1)[..., None]
    return sky + (painted - sky) * share


def _town(sky: RealArray, seed: int) -> RealArray:
    """Blocks of houses with rows of windows, far enough to be small."""
    random = np.random.default_rng(seed)
    column = 0
    while column < COLUMNS:
        width = int(random.integers(30, 110))
        top = int(random.uniform(7, 17) / (_HIGHEST - _LOWEST) * ROWS) + 27
        wall = np.array((168, 160, 150), np.float32) * random.uniform(0.7, 1.15) + random.normal(0, 8, 3)
        block = np.tile(wall, (top, min(width, COLUMNS - column), 1))
        rows, columns = np.arange(top)[:, None], np.arange(block.shape[1])[None]
        window = (rows % 9 > 3) & (columns % 10 > 4) & (columns < width - 4) & (rows > 28)
        block[window] = wall * 0.62
        sky[:top, column : column + block.shape[1]] = block
        column += width
    return sky


def _finish(sky: RealArray) -> UInt8Array:
    return np.clip(sky, 0, 255).astype(np.uint8)


def _clear() -> UInt8Array:
    sky = _gradient((92, 142, 206), (198, 216, 232))
    return _finish(_silhouette(sky, _ridge(2.2, 1, 1.6), (132, 148, 150), 0.05, 61))


def _cloudy() -> UInt8Array:
    sky = _clouds(_gradient((98, 146, 206), (200, 214, 226)), 0.45, (240, 240, 242), 62)
    return _finish(_silhouette(sky, _ridge(3.0, 2, 1.4), (112, 128, 104), 0.08, 63))


def _overcast() -> UInt8Array:
    sky = _clouds(_gradient((176, 184, 192), (212, 216, 220)), 0.6, (222, 224, 226), 64)
    return _finish(_silhouette(sky, _ridge(2.4, 3, 1.5), (120, 126, 124), 0.05, 65))


def _evening() -> UInt8Array:
    sky = _clouds(_gradient((98, 122, 168), (240, 200, 164)), 0.3, (236, 208, 190), 66)
    return _finish(_silhouette(sky, _ridge(2.0, 4, 1.4), (96, 88, 92), 0.05, 67))


def _over_town() -> UInt8Array:
    return _finish(_town(_clouds(_gradient((120, 156, 202), (208, 216, 222)), 0.35, (236, 238, 240), 68), 5))


def _over_forest() -> UInt8Array:
    sky = _clouds(_gradient((110, 152, 206), (206, 218, 226)), 0.3, (238, 238, 240), 69)
    far = _silhouette(sky, _ridge(7.0, 6, 1.2), (112, 132, 112), 0.08, 70)
    return _finish(_silhouette(far, _ridge(4.5, 7, 0.8), (70, 92, 56), 0.18, 71))


SKIES: dict[str, Callable[[], UInt8Array]] = {
    "sky-clear": _clear,
    "sky-clouds": _cloudy,
    "sky-overcast": _overcast,
    "sky-evening": _evening,
    "sky-town": _over_town,
    "sky-forest": _over_forest,
}
