"""Images of skin, cloth, hair and eyes. The first row of an image is at v = 0."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from protocol.arrays import UInt8Array
from render_worker.arrays import RealArray
from render_worker.noise import seamless_noise, shifted
from render_worker.outfit import Colour, Fabric, Hair, Outfit

SIZE = 512
"""Of every texture of a person, since they are uploaded as one array; the masks have it too."""


_GRAIN = {"denim": 0.10, "heather": 0.12}
"""How mottled cloth is that is not of one piece."""


def skin_texture(outfit: Outfit, masks: Mapping[str, UInt8Array]) -> UInt8Array:
    """(SIZE, SIZE, 3) skin with lips, ears, nails and brows, and the shade of a beard or of cropped hair."""
    random = np.random.default_rng(outfit.seed)
    tone = np.array(outfit.skin, np.float32)
    blotches = 0.020 * shifted(seamless_noise(SIZE, 1.3, 1.0, 11), random)
    pores = 0.012 * shifted(seamless_noise(SIZE, 0.3, 1.0, 12), random)
    image: RealArray = tone * (1 + (blotches + pores)[..., None] * np.array([0.8, 1.0, 1.0], np.float32))
    _paint(image, tone * (0.88, 0.58, 0.58), 0.75 * _strength(masks["lips"]))
    _paint(image, tone * (1.0, 0.86, 0.83), 0.5 * _strength(masks["ears"]))
    _paint(image, np.minimum(tone * 1.1 + 12, 255), 0.6 * _strength(masks["nails"]))
    _paint(image, tone * (0.45, 0.45, 0.48), outfit.stubble * _strength(masks["stubble"]))
    if outfit.hair is not None:
        _paint(image, np.array(outfit.hair.colour, np.float32), 0.9 * _strength(masks["scalp"]))
    _paint(image, np.array(outfit.brows, np.float32), 0.85 * _strength(masks["brows"]))
    return _to_image(image)


def fabric_texture(fabric: Fabric) -> UInt8Array:
    """(SIZE, SIZE, 3) seamless cloth."""
    random = np.random.default_rng(fabric.seed)
    base, accent = np.array(fabric.colour, np.float32), np.array(fabric.accent, np.float32)
    pattern = _pattern(fabric, random)
    image = base if pattern is None else base + (accent - base) * pattern[..., None]
    folds = 0.055 * shifted(seamless_noise(SIZE, 1.7, 2.2, 21), random)
    weave = 0.03 * shifted(seamless_noise(SIZE, 0.2, 1.0, 22), random)
    shade = 1 + folds + weave
    if (grain := _GRAIN.get(fabric.pattern)) is not None:
        shade = shade + grain * shifted(seamless_noise(SIZE, 0.6, 0.5, 23), random)
    return _to_image(image * shade[..., None])


def hair_texture(hair: Hair) -> UInt8Array:
    """(SIZE, SIZE, 3) strands along v."""
    random = np.random.default_rng(hair.seed)
    strands = 0.22 * shifted(seamless_noise(SIZE, 0.7, 0.12, 31), random)
    return _to_image(np.array(hair.colour, np.float32) * (1 + strands)[..., None])


@lru_cache(maxsize=16)
def eye_texture(iris: Colour) -> UInt8Array:
    """(SIZE, SIZE, 3) an eyeball seen from the front, its pupil in the middle; half the width is its radius."""
    offset = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    radius = np.hypot(offset[:, None], offset[None])
    image = np.full((SIZE, SIZE, 3), (228, 224, 220), np.float32)
    image[radius < 0.46] = np.array(iris, np.float32) * 0.6
    image[radius < 0.41] = iris
    image[radius < 0.19] = (12, 11, 12)
    return _to_image(image)


@lru_cache(maxsize=16)
def plain_texture(colour: Colour) -> UInt8Array:
    """(SIZE, SIZE, 3) of one colour."""
    return np.full((SIZE, SIZE, 3), colour, np.uint8)


def _pattern(fabric: Fabric, random: np.random.Generator) -> RealArray | None:
    """(SIZE, SIZE) share of the accent colour; None where there is nothing of it."""
    across = np.arange(SIZE)
    period = int(random.choice([32, 64, 128]))
    band = ((across % period) < period * random.uniform(0.25, 0.5)).astype(np.float32)
    if fabric.pattern == "stripes":
        return np.repeat(band[:, None], SIZE, axis=1)
    if fabric.pattern == "checks":
        return 0.5 * (band[:, None] + band[None])
    if fabric.pattern == "dots":
        offset = across % 32 - 15.5
        return (np.hypot(offset[:, None], offset[None]) < random.uniform(4, 9)).astype(np.float32)
    return None


def _strength(mask: UInt8Array) -> RealArray:
    return mask / np.float32(255)


def _paint(image: RealArray, colour: RealArray, strength: RealArray) -> None:
    """Mix a colour into the places of an image where its strength is above 0."""
    where = strength > 0
    image[where] += (colour - image[where]) * strength[where, None]


def _to_image(values: RealArray) -> UInt8Array:
    return np.clip(values, 0, 255, out=values).astype(np.uint8)
