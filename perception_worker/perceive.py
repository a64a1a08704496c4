"""Pictures and a filter in, a pose estimate out: the whole pipeline, without a socket."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from msgspec.structs import astuple
from numpy.typing import NDArray

from perception_worker import kalman
from perception_worker.calibration import Calibrated, Calibration
from perception_worker.detection import Detection, Detector, HeldPictures, Pictures
from perception_worker.lifter import Lifter
from perception_worker.lifter.evidence import evidence_of
from perception_worker.lifting import Windows, lift, surface_lifting, windows_around, within_reach
from perception_worker.qoe import (
    Quality,
    combined_quality,
    distance_quality,
    heatmap_cells,
    nearest_cells,
    quality_of_estimation,
)
from perception_worker.stopwatch import Clock, Stopwatch
from protocol.arrays import Float64Array
from protocol.camera import Camera
from protocol.config import PerceptionConfig, Profile, settled
from protocol.frame import Frame
from protocol.pose_estimate import Evidence, FilterState, Lifting, PoseEstimate, Reading


class _Placed(NamedTuple):
    """Joints in the world, and what is known of how far off they are; see `PoseEstimate`."""

    points: Float64Array
    expected_error: Float64Array | None
    radius: Float64Array | None
    variance: Float64Array | None


class _Located(NamedTuple):
    """A detected person in the world.

    Attributes:
        windows: the depths around the keypoints.
        quality: of each joint.
        evidence: the input of a learned lifter, where there is one or the caller wants it.
        placed: where the joints are.
    """

    windows: Windows
    quality: Quality
    evidence: Evidence | None
    placed: _Placed


class Perceiver:
    """Estimates one person's pose and how sure it is; may be called by several threads at once.

    >>> import numpy as np
    >>> from perception_worker.worker import open_perceiver
    >>> from protocol.camera import Camera, CameraPose, Intrinsics
    >>> from protocol.config import PerceptionConfig, settled
    >>> from protocol.frame import Frame
    >>> from protocol.pose_estimate import FilterState
    >>> perceiver = open_perceiver(settled(PerceptionConfig(), "vantage"))
    >>> lens = Intrinsics.from_horizontal_fov(640, 480, 70.0)
    >>> camera = Camera(CameraPose(position=(3.0, 0.0, 1.5), target=(0.0, 0.0, 1.0)), lens)
    >>> rgb, depth = np.zeros((480, 640, 3), np.uint8), np.full((480, 640), 3.0, np.float32)
    >>> estimate = perceiver.perceive(Frame(rgb=rgb, depth=depth, camera=camera), FilterState.initial())
    >>> estimate.points.shape, float(estimate.quality.max())  # a black picture shows no person
    ((18, 3), 0.0)
    """

    def __init__(
        self,
        detector: Detector,
        config: PerceptionConfig,
        *,
        profile: Profile = "vantage",
        calibration: Calibration | None = None,
        lifter: Lifter | None = None,
        clock: Clock = time.perf_counter,
    ) -> None:
        config = settled(config, profile)
        self._detector = detector
        self._lifter = lifter
        self._lifting: Lifting = surface_lifting(config)
        self._believes_all = config.look == "whole"
        self._calibration = calibration
        self._masks_others = config.mask == "skeleton"
        self._clock = clock

    def perceive(
        self,
        frame: Frame,
        filter_state: FilterState,
        *,
        heatmaps: bool = False,
        liftings: Sequence[Lifting] = (),
        evidence: bool = False,
    ) -> PoseEstimate:
        """Estimate the pose in a frame at hand; see `observe`.

        Args:
            frame: an RGB-D picture; its true joints, where it has any, are passed on.
        """
        asked = {"heatmaps": heatmaps, "evidence": evidence}
        return self.observe(HeldPictures(frame), filter_state, liftings=liftings, **asked)

    def observe(
        self,
        pictures: Pictures,
        filter_state: FilterState,
        *,
        heatmaps: bool = False,
        liftings: Sequence[Lifting] = (),
        evidence: bool = False,
    ) -> PoseEstimate:
        """Estimate the pose in a camera's picture.

        Args:
            pictures: the camera's picture; only the parts that the network is shown are asked for.
            filter_state: the filter before this moment.
            heatmaps: whether the estimate is to carry the network's heatmaps.
            liftings: ways of lifting whose readings the estimate is to carry.
            evidence: whether the estimate is to carry the input of a learned lifter.

        Returns:
            The estimate; where no person is found, all joints are NaN, all qualities 0 and the filter locates none.

        Raises:
            InvalidOutput: the network gave no maps, or a map that has a value that is not finite.
            CallFailed: no picture came; another try may succeed.
        """
        stopwatch = Stopwatch(self._clock)
        detection = self._detector.detect(pictures, filter_state, stopwatch)
        located = self._located(detection, stopwatch, evidence=evidence)
        with stopwatch.stage("filter"):
            updated = _updated(filter_state, detection, located)
        return _estimate(
            detection,
            located if evidence else located._replace(evidence=None),
            updated,
            heatmaps=heatmaps,
            readings={one: _read(self._lift(located.windows, detection, one), located.quality) for one in liftings},
            timings=pictures.timings | stopwatch.seconds,
        )

    def _located(self, detection: Detection, stopwatch: Stopwatch, *, evidence: bool) -> _Located:
        frame = detection.frame
        with stopwatch.stage("lift"):
            windows = windows_around(frame.depth, frame.area.inside(detection.keypoints))
            surface = self._lift(windows, detection, self._lifting)
            told = _evidence(detection) if evidence or self._lifter else None
        with stopwatch.stage("qoe"):
            quality = self._quality(detection, surface)
            calibrated = self._calibrate(surface, quality, windows, frame.camera)
        with stopwatch.stage("lift"):
            placed = self._learned(detection, quality, told) or _Placed(surface, *calibrated, None)
        return _Located(windows, quality, told, placed)

    def _lift(self, windows: Windows, detection: Detection, lifting: Lifting) -> Float64Array:
        points = lift(windows, detection.keypoints, detection.frame.camera, lifting)
        return points if self._believes_all else within_reach(points)

    def _quality(self, detection: Detection, points: Float64Array) -> Quality:
        others = nearest_cells(detection.others, detection.map_size) if self._masks_others else None
        return quality_of_estimation(detection.output.heatmaps, _cells(detection), points, others=others)

    def _learned(self, detection: Detection, quality: Quality, told: Evidence | None) -> _Placed | None:
        """The joints as a learned lifter places them, where there is one."""
        if self._lifter is None or told is None:
            return None
        lifted = self._lifter.lift(detection.keypoints, quality.height, told, detection.frame.camera)
        return _Placed(lifted.points, lifted.expected_error, lifted.radius, lifted.variance)

    def _calibrate(
        self, points: Float64Array, quality: Quality, windows: Windows, camera: Camera
    ) -> Calibrated | tuple[None, None]:
        if self._calibration is None:
            return None, None
        return self._calibration.calibrate(
            points,
            mass=quality.mass,
            height=quality.height,
            distance=quality.distance,
            spread=windows.spread,
            camera=camera.pose.position,
        )


def _updated(filter_state: FilterState, detection: Detection, located: _Located) -> FilterState:
    points, variance = located.placed.points, located.placed.variance
    if filter_state.rule != "variance":
        # Quality says nothing of a joint that the network has not seen, wherever a lifter places it.
        points = np.where(np.isfinite(detection.keypoints[:, :1]), points, np.nan)
    return kalman.update(filter_state, points, located.quality.combined, variance)


def _estimate(
    detection: Detection,
    located: _Located,
    updated: FilterState,
    *,
    heatmaps: bool,
    readings: dict[Lifting, Reading],
    timings: dict[str, float],
) -> PoseEstimate:
    frame, quality, placed = detection.frame, located.quality, located.placed
    return PoseEstimate(
        keypoints=detection.keypoints,
        points=placed.points,
        mass=quality.mass,
        height=quality.height,
        distance=quality.distance,
        quality=quality.combined,
        filter=updated,
        heatmaps=detection.output.heatmaps if heatmaps else None,
        heatmap_area=astuple(detection.region) if heatmaps else None,
        joints=frame.joints,
        visible=frame.visible,
        timings=timings,
        spread=located.windows.spread,
        expected_error=placed.expected_error,
        radius=placed.radius,
        readings=readings,
        evidence=located.evidence,
        variance=placed.variance,
    )


def _evidence(detection: Detection) -> Evidence:
    frame = detection.frame
    return evidence_of(frame.depth, frame.area.inside(detection.keypoints), frame.camera.intrinsics.fx)


def _read(points: Float64Array, quality: Quality) -> Reading:
    distance = distance_quality(points)
    combined = combined_quality(quality.mass, quality.height, distance)
    return Reading(points=points, distance=distance, quality=combined)


def _cells(detection: Detection) -> NDArray[np.int64]:
    """(18, 2) row and column of each keypoint in the heatmaps, -1 where there is none."""
    region = detection.region
    return heatmap_cells(region.inside(detection.keypoints), region.shape, detection.map_size)
