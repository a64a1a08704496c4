"""Boosted regression trees, as plain arrays that numpy can walk through in microseconds."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from protocol.arrays import Float32Array, Float64Array
from protocol.errors import ArtifactDamaged

_DEEPEST = 8


class StoredEnsemble(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Full trees of one depth, little-endian, tree after tree and level after level.

    Attributes:
        features: uint8, the number of the feature that each inner node asks for.
        thresholds: float32, above which the way goes right.
        leaves: float32, what each leaf adds.
    """

    depth: Annotated[int, Meta(ge=1, le=_DEEPEST)]
    features: bytes
    thresholds: bytes
    leaves: bytes


class Ensemble:
    """The sum of its trees' predictions.

    Raises:
        ArtifactDamaged: the stored arrays don't fit together, ask for unknown features, or have a leaf that is not
            finite.
    """

    def __init__(self, stored: StoredEnsemble, feature_count: int) -> None:
        inner, leaves = 2**stored.depth - 1, 2**stored.depth
        trees = len(stored.features) // inner
        sizes = len(stored.features), len(stored.thresholds), len(stored.leaves)
        if trees == 0 or sizes != (trees * inner, 4 * trees * inner, 4 * trees * leaves):
            raise ArtifactDamaged("the trees of a calibration don't fit together")
        features = np.frombuffer(stored.features, np.uint8).astype(np.intp).reshape(trees, inner)
        thresholds = np.frombuffer(stored.thresholds, "<f4").astype(np.float32).reshape(trees, inner)
        if features.max() >= feature_count:
            raise ArtifactDamaged("the trees of a calibration ask for features that there are not")
        levels = [slice(2**level - 1, 2 ** (level + 1) - 1) for level in range(stored.depth)]
        self._leaves = np.frombuffer(stored.leaves, "<f4").astype(np.float64)
        # A threshold may be infinite: a leaf that is not as deep as the others is filled up below such a threshold.
        if np.isnan(thresholds).any() or not np.isfinite(self._leaves).all():
            raise ArtifactDamaged("the trees of a calibration have leaves that are not finite, or no threshold")
        # Node k of a level has the nodes 2 k and 2 k + 1 of the next below it, whichever tree it belongs to.
        self._levels = [(features[:, level].ravel(), thresholds[:, level].ravel()) for level in levels]
        self._roots = np.arange(trees)

    def predict(self, samples: Float32Array) -> Float64Array:
        """The sum of the trees for each sample.

        Args:
            samples: (n, features); no NaN, which no threshold can order.

        Returns:
            (n,)
        """
        values = samples.ravel()
        row = (np.arange(len(samples)) * samples.shape[1])[:, None]
        node = np.tile(self._roots, (len(samples), 1))
        # No index is ever out of range, and numpy is a third faster where it does not check.
        for features, thresholds in self._levels:
            asked = values.take(row + features.take(node, mode="clip"), mode="clip")
            node = 2 * node + (asked > thresholds.take(node, mode="clip"))
        return self._leaves.take(node, mode="clip").sum(axis=1)


def stored_ensemble(trees: Sequence[dict[str, Any]], depth: int) -> StoredEnsemble:
    """Trees as LightGBM dumps them (`tree_structure`), none deeper than `depth`.

    A leaf higher up fills all that is below it.
    """
    inner, leaves = 2**depth - 1, 2**depth
    features = np.zeros((len(trees), inner), np.uint8)
    thresholds = np.full((len(trees), inner), np.inf, np.float32)
    values = np.zeros((len(trees), leaves), np.float32)
    for number, tree in enumerate(trees):
        _fill(tree, 0, features[number], thresholds[number], values[number])
    return StoredEnsemble(
        depth=depth,
        features=features.tobytes(),
        thresholds=thresholds.astype("<f4").tobytes(),
        leaves=values.astype("<f4").tobytes(),
    )


def _fill(
    node: dict[str, Any], place: int, features: NDArray[np.uint8], thresholds: Float32Array, values: Float32Array
) -> None:
    if place >= len(features):
        values[place - len(features)] = node["leaf_value"]
        return
    is_leaf = "leaf_value" in node
    if not is_leaf:
        features[place], thresholds[place] = node["split_feature"], node["threshold"]
    for child, name in enumerate(("left_child", "right_child")):
        _fill(node if is_leaf else node[name], 2 * place + 1 + child, features, thresholds, values)
