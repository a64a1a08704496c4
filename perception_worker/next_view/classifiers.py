"""The thesis's state-action predictors: perceptrons that name the best of eight cameras (section 4.2).

Per joint they are given its position in the camera's frame, which is x to the right, y down and z along the view in
metres, and its quality: 72 numbers a view, all 0 for a joint that was not located.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import torch
from torch.nn.functional import cross_entropy

from perception_worker.next_view.arrays import AROUND, CENTRE, Arrays
from perception_worker.next_view.choices import Choices
from perception_worker.next_view.perceptron import Recipe, trained
from protocol.arrays import Float32Array, Float64Array

LEFT, RIGHT, ABOVE, BELOW = 3, 5, 1, 7
"""The cameras next to the centre."""

THESIS_LAYERS: tuple[tuple[int, ...], ...] = ((64,), (32,), (32, 32))
PICTURE_LAYERS = (128, 16)

PATHS: Mapping[str, tuple[int, ...]] = {
    "joints and quality of 2 views": (LEFT, CENTRE),
    "joints and quality of 3 views": (LEFT, CENTRE, RIGHT),
}
"""Views along a short path that ends, or passes, at the centre."""

_EPOCHS = 300


def thesis_classifiers(arrays: Arrays, pictures: Float64Array, seeds: Sequence[int]) -> Iterator[Choices]:
    """The thesis's four predictors.

    Args:
        pictures: (n, 512) features of the centre's picture.
    """
    centre = joints_and_quality(arrays, (CENTRE,))
    both = np.concatenate([pictures.astype(np.float32), centre], axis=1)
    yield from _classified(arrays, both, "thesis", "picture, joints and quality", PICTURE_LAYERS, seeds)
    for layers in THESIS_LAYERS:
        yield from _classified(arrays, centre, "thesis", "joints and quality", layers, seeds)


def path_classifiers(arrays: Arrays, seeds: Sequence[int]) -> Iterator[Choices]:
    """The same with a memory: predictors that are given the views of a short path."""
    for name, cameras in PATHS.items():
        yield from _classified(arrays, joints_and_quality(arrays, cameras), "memory", name, THESIS_LAYERS[0], seeds)


def joints_and_quality(arrays: Arrays, cameras: Sequence[int]) -> Float32Array:
    """(n, 72 for each camera) what the thesis's predictors are given."""
    views = [np.concatenate([_points_seen(arrays, one), arrays.quality[:, one, :, None]], axis=2) for one in cameras]
    return np.nan_to_num(np.stack(views, axis=1)).reshape(len(arrays), -1).astype(np.float32)


def _points_seen(arrays: Arrays, camera: int) -> Float64Array:
    """(n, 18, 3) the located joints in the camera's frame."""
    transforms = arrays.transforms()[:, camera]
    return np.einsum("nij,nkj->nki", transforms[:, :3, :3], arrays.points[:, camera]) + transforms[:, None, :3, 3]


def _classified(
    arrays: Arrays, inputs: Float32Array, group: str, name: str, hidden: tuple[int, ...], seeds: Sequence[int]
) -> Iterator[Choices]:
    best = torch.from_numpy(arrays.uncertainty[:, AROUND].argmin(axis=1))
    train = arrays.is_train
    layers = [inputs.shape[1], *hidden, len(AROUND)]
    for seed in seeds:
        network = trained(
            inputs[train],
            best[torch.from_numpy(train)],
            len(AROUND),
            Recipe(hidden=hidden, epochs=_EPOCHS),
            cross_entropy,
            seed,
        )
        yield Choices(group=group, method=f"{name} {layers}", seed=seed, expected=-network.predict(inputs))
