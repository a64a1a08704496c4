"""A person's clothes and looks, drawn from the scene's appearance seed.

Heights are fractions of the body's height, lengths of sleeves count along the arm (1 at the elbow, 2 at the wrist).
Colours are sRGB, 0 to 255.
"""

import dataclasses
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

Colour: TypeAlias = tuple[int, int, int]
Pattern: TypeAlias = Literal["plain", "stripes", "checks", "heather", "denim", "dots"]

SKIN_TONES: tuple[Colour, ...] = (
    (236, 198, 172),
    (226, 180, 148),
    (214, 164, 130),
    (196, 143, 108),
    (172, 120, 86),
    (141, 93, 64),
    (112, 72, 50),
    (86, 56, 40),
)
HAIR_COLOURS: tuple[Colour, ...] = (
    (28, 22, 20),
    (46, 32, 24),
    (74, 50, 32),
    (104, 74, 46),
    (150, 116, 70),
    (120, 62, 36),
    (128, 126, 124),
)
EYE_COLOURS: tuple[Colour, ...] = ((70, 46, 28), (96, 66, 38), (92, 104, 66), (78, 104, 128), (104, 116, 118))
FABRIC_COLOURS: tuple[Colour, ...] = (
    (226, 224, 218),
    (168, 170, 172),
    (92, 94, 98),
    (44, 46, 50),
    (32, 44, 72),
    (58, 88, 132),
    (128, 160, 190),
    (132, 40, 44),
    (182, 74, 60),
    (206, 160, 82),
    (84, 104, 70),
    (46, 74, 62),
    (118, 92, 130),
    (196, 150, 150),
    (120, 96, 76),
)
TROUSER_COLOURS: tuple[Colour, ...] = (
    (44, 56, 84),
    (66, 84, 116),
    (30, 32, 38),
    (70, 70, 74),
    (120, 104, 82),
    (164, 148, 122),
    (62, 66, 52),
    (92, 72, 58),
)
SHOE_COLOURS: tuple[Colour, ...] = ((34, 32, 32), (78, 56, 42), (196, 194, 190), (92, 96, 102), (120, 44, 42))


SKIRT_WAIST = 0.585
"""Height of a skirt's upper edge."""


@dataclass(frozen=True)
class Fabric:
    """Colours and pattern of a cloth; `seed` places its folds."""

    pattern: Pattern
    colour: Colour
    accent: Colour
    seed: int


@dataclass(frozen=True)
class Garment:
    """Cloth over a part of the body.

    Attributes:
        part: which surface it is cut from.
        lowest, highest: heights between which there is cloth.
        sleeve: how far along the arm it reaches; 0 for what leaves the arms alone.
        neck: how much lower the neckline is in front, by the depth of the chest.
        offset: metres by which it stands off the surface it is cut from.
    """

    part: Literal["tights", "skirt"]
    lowest: float
    highest: float
    sleeve: float
    neck: float
    offset: float
    fabric: Fabric


@dataclass(frozen=True)
class Hair:
    """Hair.

    Attributes:
        thickness: metres by which it stands off the scalp.
        length: by how much it reaches lower at the nape.
        falls: by how much long hair falls below the nose at the back; 0 for hair that doesn't.
        seed: of its strands.
    """

    colour: Colour
    thickness: float
    length: float
    falls: float
    seed: int


@dataclass(frozen=True)
class Outfit:
    """Everything that the appearance seed decides. Later garments lie over earlier ones."""

    skin: Colour
    eyes: Colour
    hair: Hair | None
    brows: Colour
    stubble: float
    garments: tuple[Garment, ...]
    seed: int


def sample_outfit(appearance: int, *, feminine: bool) -> Outfit:
    """Draw an outfit; the same seed gives the same one everywhere."""
    random = np.random.default_rng([appearance & 0xFFFFFFFF, appearance >> 32 & 0xFFFFFFFF, 7])
    tone = int(random.integers(len(SKIN_TONES)))
    # Fair hair goes with fair skin.
    hair_colour = HAIR_COLOURS[int(random.integers(len(HAIR_COLOURS) if tone < 4 else 3))]
    eyes = EYE_COLOURS[int(random.integers(len(EYE_COLOURS) if tone < 4 else 2))]
    bottom = _skirt(random) if feminine and random.random() < 0.3 else _trousers(random)
    top = _top(random)
    # A skirt stands off too far to go under a shirt.
    top = dataclasses.replace(top, lowest=SKIRT_WAIST - 0.01) if bottom.part == "skirt" else top
    return Outfit(
        skin=SKIN_TONES[tone],
        eyes=eyes,
        hair=_hair(random, hair_colour, feminine=feminine),
        brows=_darker(hair_colour, 0.75),
        stubble=0.0 if feminine else float(random.choice([0.0, 0.0, 0.35, 0.6])),
        garments=(_shoes(random), bottom, top),
        seed=int(random.integers(2**31)),
    )


def _hair(random: np.random.Generator, colour: Colour, *, feminine: bool) -> Hair | None:
    if not feminine and random.random() < 0.12:
        return None
    thickness = float(random.uniform(0.010, 0.020) if feminine else random.uniform(0.004, 0.013))
    length = float(random.uniform(0.01, 0.035) if feminine else 0.0)
    falls = float(random.uniform(0.03, 0.08)) if feminine and random.random() < 0.5 else 0.0
    return Hair(colour, thickness, length, falls, int(random.integers(2**31)))


def _top(random: np.random.Generator) -> Garment:
    sleeve = float(random.choice([0.12, 0.5, 0.62, 0.75, 1.45, 1.9, 1.93]))
    pattern: Pattern = ("plain", "plain", "heather", "stripes", "checks", "dots")[int(random.integers(6))]
    return Garment(
        part="tights",
        lowest=float(random.uniform(0.49, 0.545)),
        highest=float(random.uniform(0.835, 0.85)),
        sleeve=sleeve,
        neck=float(random.uniform(0.2, 0.75)),
        offset=float(random.uniform(0.008, 0.016)),
        fabric=_fabric(random, pattern, FABRIC_COLOURS),
    )


def _trousers(random: np.random.Generator) -> Garment:
    short = random.random() < 0.25
    return Garment(
        part="tights",
        lowest=float(random.uniform(0.27, 0.36) if short else random.uniform(0.035, 0.07)),
        highest=0.6,
        sleeve=0.0,
        neck=0.0,
        offset=float(random.uniform(0.004, 0.008)),
        fabric=_fabric(random, "denim" if random.random() < 0.5 else "plain", TROUSER_COLOURS),
    )


def _skirt(random: np.random.Generator) -> Garment:
    pattern: Pattern = ("plain", "plain", "checks", "dots")[int(random.integers(4))]
    return Garment(
        part="skirt",
        lowest=float(random.uniform(0.2, 0.36)),
        highest=SKIRT_WAIST,
        sleeve=0.0,
        neck=0.0,
        offset=0.010,
        fabric=_fabric(random, pattern, FABRIC_COLOURS),
    )


def _shoes(random: np.random.Generator) -> Garment:
    return Garment(
        part="tights",
        lowest=-1.0,
        highest=float(random.choice([0.042, 0.05, 0.065])),
        sleeve=0.0,
        neck=0.0,
        offset=0.003,
        fabric=_fabric(random, "plain", SHOE_COLOURS),
    )


def _fabric(random: np.random.Generator, pattern: Pattern, colours: tuple[Colour, ...]) -> Fabric:
    first, second = (colours[int(random.integers(len(colours)))] for _ in range(2))
    return Fabric(pattern, first, second, int(random.integers(2**31)))


def _darker(colour: Colour, factor: float) -> Colour:
    red, green, blue = (int(value * factor) for value in colour)
    return red, green, blue
