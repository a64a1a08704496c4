"""A perception worker's estimate of a pose: the place and the quality of each joint, and the filter's state."""

from collections.abc import Mapping
from typing import Annotated, Literal, TypeAlias

import numpy as np

from protocol.arrays import BoolArray, Elements, Float32Array, Float64Array
from protocol.camera import Vector3
from protocol.joint_arrays import (
    FARTHEST,
    MOST_VARIANCE,
    JointEvidence,
    JointFlags,
    JointMetres,
    JointPixels,
    JointPoints,
    JointQuality,
    JointTruth,
    JointVariance,
)
from protocol.message import Reply, Value
from protocol.quantities import Measured
from protocol.skeleton import JOINT_COUNT

Lifting: TypeAlias = Literal["mean", "median", "nearest"]
"""How a joint's depth is taken from the 7×7 depths around its keypoint: their mean (thesis, section 3.2),
their median, or the mean of the nearest surface."""

FilterRule: TypeAlias = Literal["quality", "variance"]
"""Where a filter takes an observation's noise from: 1 - its quality, taken for m² (thesis, section 3.3.4), or the
variance that a learned lifter gives it."""

INITIAL_VARIANCE = 1.0
BASE_PROCESS_NOISE = 0.01
"""m² a frame, of a filter by quality."""

BASE_PROCESS_NOISES: Mapping[FilterRule, float] = {"quality": BASE_PROCESS_NOISE, "variance": 1e-5}
"""m² by which a joint's variance grows from one frame that locates it to the next."""


class FilterState(Value, frozen=True, eq=False):
    """The Kalman filter over 18 joints at rest (thesis, section 3.3.4). It travels: out with a request, back updated.

    Attributes:
        mean: (18, 3) world frame, metres.
        variance: (18, 3) diagonal of the posterior covariance, m².
        process_noise: (18,) diagonal of Q for each joint, m²; it grows while a joint is not seen.
        seen: (18,) whether the joint was ever observed.
        rule: what it takes for the noise of a measured joint; without a learned lifter's variance, always the quality.
    """

    mean: Annotated[Float64Array, Elements((JOINT_COUNT, 3), -FARTHEST, FARTHEST)]
    variance: Annotated[Float64Array, Elements((JOINT_COUNT, 3), 0.0, MOST_VARIANCE)]
    process_noise: Annotated[Float64Array, Elements((JOINT_COUNT,), 0.0, MOST_VARIANCE)]
    seen: JointFlags
    rule: FilterRule = "quality"

    @classmethod
    def initial(cls, mean: Vector3 = (0.0, 0.0, 0.0), rule: FilterRule = "quality") -> "FilterState":
        """Nothing seen yet: every joint at `mean` with a variance of 1 m²."""
        return cls(
            mean=np.tile(np.asarray(mean, float), (JOINT_COUNT, 1)),
            variance=np.full((JOINT_COUNT, 3), INITIAL_VARIANCE),
            process_noise=np.full(JOINT_COUNT, BASE_PROCESS_NOISES[rule]),
            seen=np.zeros(JOINT_COUNT, bool),
            rule=rule,
        )


class Reading(Value, frozen=True, eq=False, kw_only=True):
    """The result of one frame with another way of lifting.

    Attributes:
        points: (18, 3) world frame, metres; NaN where a joint was not located.
        distance, quality: (18,) in [0, 1], as in `PoseEstimate`; mass and height don't depend on depth.
    """

    points: JointPoints
    distance: JointQuality
    quality: JointQuality


class Evidence(Value, frozen=True, eq=False, kw_only=True):
    """The input of a learned lifter apart from the keypoints: statistics of the depths around them.

    Attributes:
        narrow, wide: (18, 7) of two windows around each keypoint, of a few pixels and of the size of a body part: the
            share of valid depths, and their minimum, 10th, 25th, 50th and 75th percentiles, and maximum, in metres;
            NaN without valid depths.
    """

    narrow: JointEvidence
    wide: JointEvidence


class PoseEstimate(Reply, frozen=True, eq=False, kw_only=True):
    """Joints, their quality, and the filter after this frame.

    Attributes:
        keypoints: (18, 2) pixels x, y in the frame; NaN where a joint was not detected.
        points: (18, 3) world frame, metres; NaN where a joint was not located. A learned lifter locates all joints of a
            person that is found; those that were not detected are `inferred`.
        mass, height, distance, quality: (18,) in [0, 1], 1 is best (thesis, section 3.3); 0 where not detected.
        filter: the state to send with the next frame.
        heatmaps: (19, rows, columns) the network's output, if it was requested.
        heatmap_area: left, top, width and height, in pixels, of the part of the frame that the heatmaps cover.
        spread: (18,) metres between the nearest and the farthest depth in the window by which a keypoint was lifted;
            NaN where a joint was not located.
        expected_error: (18,) expected distance in metres between `points` and the true joint; NaN where a joint was not
            located; None if the worker is not calibrated.
        radius: (18,) metres; a sphere around `points` that contains the joint with probability 0.9; NaN and None
            likewise.
        variance: (18, 3) m² of `points` along the world's axes; NaN likewise; None without a learned lifter.
        readings: of the other ways of lifting that were requested.
        evidence: the input of a learned lifter, if it was requested.
        joints, visible: the truth that came with the frame, if it was requested.
        timings: seconds by stage: render, infer, decode, lift, qoe, filter, and transport between the workers; for a
            packed frame also pack and unpack.
    """

    keypoints: JointPixels
    points: JointPoints
    mass: JointQuality
    height: JointQuality
    distance: JointQuality
    quality: JointQuality
    filter: FilterState
    heatmaps: Annotated[Float32Array, Elements((None, None, None))] | None = None
    heatmap_area: tuple[int, int, int, int] | None = None
    joints: JointTruth | None = None
    visible: JointFlags | None = None
    timings: dict[str, Measured] = {}
    spread: JointMetres | None = None
    expected_error: JointMetres | None = None
    radius: JointMetres | None = None
    readings: dict[Lifting, Reading] = {}
    evidence: Evidence | None = None
    variance: JointVariance | None = None

    @property
    def inferred(self) -> BoolArray:
        """(18,) the joints that were located without being detected, from the other joints."""
        return np.isfinite(self.points[:, 0]) & np.isnan(self.keypoints[:, 0])
