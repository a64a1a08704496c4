"""A map of the expected uncertainty around a person, fitted on what every camera of the arrays saw.

PoseErrNet (arXiv 2407.01811) predicts the error of a pose estimate for viewpoints around a person. So does this: from
the person's pose, in their own frame, and a viewpoint in that frame, a perceptron predicts the uncertainty that a
camera there will have. The camera with the lowest prediction is chosen.

A prediction may also depend on what was seen on the way: from where, and with which quality and uncertainty.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct
from torch.nn.functional import mse_loss

from perception_worker.next_view.arrays import AROUND, CAMERAS, CENTRE, Arrays
from perception_worker.next_view.choices import Choices
from perception_worker.next_view.classifiers import ABOVE, BELOW, LEFT, RIGHT
from perception_worker.next_view.people import person_frame
from perception_worker.next_view.perceptron import Perceptron, Recipe, trained
from protocol.arrays import Float32Array, Float64Array
from protocol.skeleton import MIRRORED

RECIPE = Recipe(
    hidden=(128, 64), epochs=16, batch=512, learning_rate=2e-3, weight_decay=1e-2, dropout=0.1, falling=True
)

_MIRROR = np.array([1.0, -1.0, 1.0])
"""A person's frame in a mirror: left and right change places."""


class Map(Struct, frozen=True, kw_only=True):
    """A kind of map.

    Attributes:
        method: its name.
        seen: views at a choice; the present one is first.
        ways: views to learn from, in place of `seen`.
        told: whether predictions depend on what was seen there.
        group: of similar ways of choosing.
    """

    method: str
    seen: tuple[int, ...] = (CENTRE,)
    ways: tuple[tuple[int, ...], ...] = tuple((camera,) for camera in range(CAMERAS))
    told: bool = True
    group: str = "map"


MAPS: tuple[Map, ...] = (
    Map(method="pose and viewpoint", told=False),
    Map(method="pose and viewpoint, quality of 1 view"),
    Map(
        method="pose and viewpoint, quality of 2 views",
        seen=(CENTRE, LEFT),
        ways=tuple((row + a, row + b) for row in (0, 3, 6) for a, b in ((0, 1), (1, 0), (1, 2), (2, 1))),
    ),
    Map(
        method="pose and viewpoint, quality of 3 views",
        seen=(CENTRE, LEFT, RIGHT),
        ways=tuple((row + 1, row, row + 2) for row in (0, 3, 6)),
    ),
    Map(
        method="pose and viewpoint, quality of 5 views",
        seen=(CENTRE, LEFT, RIGHT, ABOVE, BELOW),
        # The corners as well, and in another order: what was seen where is told by the viewpoints.
        ways=((4, 3, 5, 1, 7), (4, 1, 7, 3, 5), (4, 0, 2, 6, 8), (4, 6, 8, 0, 2)),
    ),
)

BOUNDS: tuple[Map, ...] = (
    Map(method="pose as it is and viewpoint", told=False, group="bound"),
    Map(method="pose as it is and viewpoint, quality of 1 view", group="bound"),
)


def error_maps(arrays: Arrays, joints: Float64Array, kinds: Sequence[Map], seeds: Sequence[int]) -> Iterator[Choices]:
    """Every map's choices.

    Args:
        joints: (n, 9, 18, 3) as known from each view, world frame, metres; NaN where no person was found.
    """
    for kind in kinds:
        chooser = MapChooser(arrays, joints, kind)
        for seed in seeds:
            yield Choices(group=kind.group, method=kind.method, seed=seed, expected=chooser.expected(seed))


class MapChooser:
    """Fits a kind of map, and has its predictions choose."""

    def __init__(self, arrays: Arrays, joints: Float64Array, kind: Map) -> None:
        self._arrays = arrays
        self._joints = joints
        self._kind = kind

    def expected(self, seed: int) -> Float64Array:
        """(n, 8) the uncertainty of each camera around the centre: predicted, or as it was where it was seen."""
        predicted = self._predicted(self._fitted(seed))
        seen = list(self._kind.seen[1:])
        predicted[:, seen] = self._arrays.uncertainty[:, seen]
        return predicted[:, AROUND]

    def _fitted(self, seed: int) -> Perceptron:
        train = self._arrays.is_train
        samples = [self._samples(way, mirrored)[train] for way in self._kind.ways for mirrored in (False, True)]
        inputs = np.concatenate(samples).reshape(-1, samples[0].shape[-1])
        uncertainty = self._arrays.uncertainty[train].astype(np.float32)
        targets = np.tile(uncertainty.reshape(-1, 1), (len(samples), 1))
        return trained(inputs, targets, 1, RECIPE, mse_loss, seed)

    def _predicted(self, fitted: Perceptron) -> Float64Array:
        """(n, 9) averaged with the prediction for the mirror image, so that neither side is preferred."""
        both = [self._samples(self._kind.seen, mirrored) for mirrored in (False, True)]
        outputs = [fitted.predict(one.reshape(-1, one.shape[-1])).reshape(-1, CAMERAS) for one in both]
        return (outputs[0] + outputs[1]) / 2

    def _samples(self, seen: tuple[int, ...], mirrored: bool) -> Float32Array:
        """(n, 9, d) the inputs for each camera, where some views were seen."""
        arrays, kind = self._arrays, self._kind
        joints = self._joints[:, seen[0]]
        frame = person_frame(joints, arrays.target[:, seen[0], :2])
        pose, places = _side(frame.local(joints), mirrored, joints=True), _side(frame.local(arrays.position), mirrored)
        known = [np.nan_to_num(pose).reshape(len(arrays), -1), frame.found[:, None]]
        if kind.told:
            for camera in seen:
                quality = arrays.quality[:, camera]
                known += [
                    quality[:, MIRRORED] if mirrored else quality,
                    arrays.uncertainty[:, camera, None],
                    viewpoint(places[:, camera]),
                ]
        shared = np.concatenate(known, axis=1)
        everywhere = np.repeat(shared[:, None], CAMERAS, axis=1)
        return np.concatenate([everywhere, viewpoint(places)], axis=2).astype(np.float32)


def viewpoint(places: Float64Array) -> Float64Array:
    """(..., 7) numbers that tell a viewpoint (..., 3) in a person's frame: near and far, around, and up."""
    distance = np.hypot(places[..., 0], places[..., 1])
    angle = np.arctan2(places[..., 1], places[..., 0])
    around = (np.cos(angle), np.sin(angle), np.cos(2 * angle), np.sin(2 * angle))
    return np.stack([distance, 1.0 / distance, places[..., 2], *around], axis=-1)


def _side(points: Float64Array, mirrored: bool, *, joints: bool = False) -> Float64Array:
    """Points (n, k, 3) in a person's frame, or in that of their mirror image."""
    if not mirrored:
        return points
    return (points[:, MIRRORED] if joints else points) * _MIRROR
