"""Which sixty people there are: adults of both builds of body, spread over weight and height."""

from collections.abc import Callable, Iterator

import numpy as np

from protocol.arrays import Float64Array
from protocol.skeleton import Joint
from render_worker.baking.anny_bodies import RestBody

IDENTITY_COUNT = 60
SEED = 20261122

MARGIN = 0.002
SHORTEST_ARM = 0.25
NARROWEST_SHOULDER = 0.15
NOSE_HEIGHT = (1.42, 1.80)
"""The thesis's minima of bones in metres (section 3.3.2), and how tall a standing adult's nose is."""

_RANGES = {
    "age": (0.67, 0.82),
    "muscle": (0.25, 0.8),
    "weight": (0.15, 0.85),
    "height": (0.34, 0.66),
    "proportions": (0.3, 0.95),
}
_ARM_BONES = (
    (Joint.RIGHT_SHOULDER, Joint.RIGHT_ELBOW),
    (Joint.RIGHT_ELBOW, Joint.RIGHT_WRIST),
    (Joint.LEFT_SHOULDER, Joint.LEFT_ELBOW),
    (Joint.LEFT_ELBOW, Joint.LEFT_WRIST),
)
_COLLARBONES = ((Joint.NECK, Joint.RIGHT_SHOULDER), (Joint.NECK, Joint.LEFT_SHOULDER))

Phenotype = dict[str, float]


def choose_identities(body_of: Callable[[Phenotype], RestBody], count: int = IDENTITY_COUNT) -> list[Phenotype]:
    """The phenotypes of all identities, women and men by turns, each an adult with the bones of the thesis."""
    chosen: list[Phenotype] = []
    for phenotype in _candidates():
        if len(chosen) == count:
            break
        wanted = "female" if len(chosen) % 2 == 0 else "male"
        phenotype["gender"] = phenotype["gender"] if wanted == "female" else 1 - phenotype["gender"]
        if is_adult(body_of(phenotype)):
            chosen.append(phenotype)
    return chosen


def is_adult(body: RestBody) -> bool:
    """Whether the nose is as high as an adult's and no upper-body bone is shorter than the thesis's minimum."""
    nose = body.joints[Joint.NOSE, 2] - body.vertices[:, 2].min()
    return bool(
        NOSE_HEIGHT[0] + MARGIN < nose < NOSE_HEIGHT[1] - MARGIN
        and _lengths(body, _ARM_BONES).min() > SHORTEST_ARM + MARGIN
        and _lengths(body, _COLLARBONES).min() > NARROWEST_SHOULDER + MARGIN
    )


def _lengths(body: RestBody, bones: tuple[tuple[Joint, Joint], ...]) -> Float64Array:
    return np.array([float(np.linalg.norm(body.joints[a] - body.joints[b])) for a, b in bones])


def _candidates() -> Iterator[Phenotype]:
    """Phenotypes spread evenly by an additive recurrence (R-sequence), so that any run of them covers the ranges."""
    names = ("gender", *_RANGES)
    step = _generalised_golden_ratio(len(names)) ** -np.arange(1.0, len(names) + 1)
    start = np.random.default_rng(SEED).random(len(names))
    index = 0
    while True:
        fraction = (start + index * step) % 1
        index += 1
        phenotype = {"gender": float(0.88 - 0.28 * fraction[0])}
        for name, value in zip(names[1:], fraction[1:], strict=True):
            low, high = _RANGES[name]
            phenotype[name] = float(low + (high - low) * value)
        yield phenotype


def _generalised_golden_ratio(dimensions: int) -> float:
    """The root above 1 of x^(d+1) = x + 1."""
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (dimensions + 1))
    return root
