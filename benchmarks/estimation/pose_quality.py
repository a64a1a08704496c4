"""How good a pose network is for the task: the share it finds, its errors, and whether its quality tells them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from msgspec import Struct

from benchmarks.estimation.detection import finding
from protocol.arrays import BoolArray, Float64Array
from protocol.errors import InvalidInput
from protocol.messages import Observe
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import Joint

BEHIND = 120.0
"""Degrees from the front; a camera further round sees no face."""

MOST_ERROR = 1.0
"""Metres at which an error is clipped, where it is: a joint farther off is lost."""

_FACE = [Joint.NOSE, Joint.RIGHT_EYE, Joint.LEFT_EYE]


BANDS = {"under 3 m": (0.0, 3.0), "3 to 6 m": (3.0, 6.0), "beyond 6 m": (6.0, np.inf)}
"""Metres along the ground from the person to the camera, the upper end excluded."""


class View(NamedTuple):
    """A request, its degrees from the person's front, and its metres along the ground."""

    request: Observe
    angle: float
    distance: float


class Comparison(Struct, frozen=True, eq=False):
    """One view's estimate against its truth, (18,) each.

    Attributes:
        detected: in the picture.
        error: metres from the true joint; NaN for joints that are not located.
        uncertainty: 1 - quality.
        visible: to the camera.
        right, swapped: as `benchmarks.estimation.detection` defines them.
        behind: whether the camera sees no face.
        distance: metres along the ground.
        identity: whose body it is.
    """

    detected: BoolArray
    error: Float64Array
    uncertainty: Float64Array
    visible: BoolArray
    right: BoolArray
    swapped: BoolArray
    behind: bool
    distance: float
    identity: int


class Correlation(NamedTuple):
    """Pearson's, and its 95% interval by bootstrap over people."""

    value: float
    low: float
    high: float


class Figures(Struct, frozen=True):
    """Of one network over all views.

    Attributes:
        found: joints detected in a view, of 18, on average.
        right: of the visible joints, the share within 5% of the body's height in the picture; `right_in` by `BANDS`.
        error, mean_error: metres, the median and the mean over all located joints.
        correlation, clipped_correlation: Pearson's, over views with a located joint, of mean uncertainty and mean error
            of the located joints; the error as it is, and clipped.
        swapped: of the visible joints, the share nearer to their mirror joint.
        faces_behind: of the views from behind, the share with a nose or an eye.
        nobody: of all views, the share with no joint.
    """

    found: float
    right: float
    right_in: tuple[float, ...]
    error: float
    mean_error: float
    correlation: Correlation
    clipped_correlation: Correlation
    swapped: float
    faces_behind: float
    nobody: float


def compare(view: View, estimate: PoseEstimate) -> Comparison:
    """Compare an estimate with the truth that came with it.

    Raises:
        InvalidInput: no truth came.
    """
    if estimate.joints is None or estimate.visible is None:
        raise InvalidInput("the estimate has no truth to compare it with")
    found = finding(view.request, estimate)
    return Comparison(
        detected=np.isfinite(estimate.keypoints[:, 0]),
        error=np.where(estimate.inferred, np.nan, np.linalg.norm(estimate.points - estimate.joints, axis=1)),
        uncertainty=1 - estimate.quality,
        visible=estimate.visible,
        right=found.found,
        swapped=found.swapped,
        behind=abs(view.angle) > BEHIND,
        distance=view.distance,
        identity=view.request.scene.identity,
    )


def figures(comparisons: Sequence[Comparison]) -> Figures:
    """Over all views; a figure without data is NaN."""
    detected, error, visible, right, swapped = (
        np.stack([getattr(one, name) for one in comparisons])
        for name in ("detected", "error", "visible", "right", "swapped")
    )
    behind = np.array([one.behind for one in comparisons])
    bands = _bands(np.array([one.distance for one in comparisons]))
    located = error[np.isfinite(error)]
    face: BoolArray = np.any(detected[:, _FACE], axis=1)
    nobody: BoolArray = ~np.any(detected, axis=1)
    raw, clipped = frame_correlations(comparisons)
    return Figures(
        found=float(detected.sum(axis=1).mean()),
        right=_mean(right[visible]),
        right_in=tuple(_mean(right[band][visible[band]]) for band in bands),
        error=float(np.median(located)) if located.size else np.nan,
        mean_error=float(np.mean(located)) if located.size else np.nan,
        correlation=raw,
        clipped_correlation=clipped,
        swapped=_mean(swapped[visible]),
        faces_behind=_mean(face[behind]),
        nobody=_mean(nobody),
    )


def _bands(distance: Float64Array) -> list[BoolArray]:
    return [(distance >= nearest) & (distance < farthest) for nearest, farthest in BANDS.values()]


def frame_correlations(comparisons: Sequence[Comparison], draws: int = 1000) -> tuple[Correlation, Correlation]:
    """Between a view's mean uncertainty and its mean error, over located joints: raw, and clipped at 1 m."""
    located = [(one, np.isfinite(one.error)) for one in comparisons]
    some = [(one, there) for one, there in located if there.any()]
    means = np.array(
        [
            (one.uncertainty[there].mean(), one.error[there].mean(), np.minimum(one.error[there], MOST_ERROR).mean())
            for one, there in some
        ]
    ).reshape(-1, 3)
    people = [np.flatnonzero([one.identity == who for one, _ in some]) for who in {one.identity for one, _ in some}]
    rng = np.random.default_rng(0)
    drawn = [
        means[np.concatenate([people[who] for who in rng.integers(len(people), size=len(people))])]
        for _ in range(draws if people else 0)
    ]
    raw, clipped = (_correlation(means, drawn, column) for column in (1, 2))
    return raw, clipped


def _correlation(means: Float64Array, drawn: Sequence[Float64Array], column: int) -> Correlation:
    again = [_pearson(one[:, 0], one[:, column]) for one in drawn]
    low, high = np.nanquantile(again, [0.025, 0.975]) if np.isfinite(again).any() else (np.nan, np.nan)
    return Correlation(_pearson(means[:, 0], means[:, column]), float(low), float(high))


def _pearson(one: Float64Array, other: Float64Array) -> float:
    if len(one) < 2 or np.std(one) == 0 or np.std(other) == 0:
        return np.nan
    return float(np.corrcoef(one, other)[0, 1])


def _mean(values: BoolArray) -> float:
    return float(values.mean()) if values.size else np.nan
