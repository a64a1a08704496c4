"""Pictures and a filter in, an observation out: the whole pipeline, without a socket."""

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from msgspec.structs import astuple
from numpy.typing import NDArray

from perception_worker import kalman
from perception_worker.calibration import Calibrated, Calibration
from perception_worker.lifter import Lifter
from perception_worker.lifter.evidence import evidence_of
from perception_worker.lifting import Windows, lift, surface_lifting, windows_around, within_reach
from perception_worker.look import HeldPictures, Look, Pictures, Sight
from perception_worker.qoe import Quality, distance_quality, heatmap_cells, nearest_cells, quality_of_estimation
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
        look: Look,
        config: PerceptionConfig,
        *,
        profile: Profile = "vantage",
        calibration: Calibration | None = None,
        lifter: Lifter | None = None,
        clock: Clock = time.perf_counter,
    ) -> None:
        config = settled(config, profile)
        self._look = look
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
        """Estimate the pose in what a camera sees.

        Args:
            pictures: what the camera sees, of which as much is asked for as is looked at.
            filter_state: the filter before this moment.
            heatmaps: whether the observation is to carry the network's heatmaps.
            liftings: ways of lifting whose readings it is to carry.
            evidence: whether it is to carry what a learned lifter is told.

        Returns:
            The observation; where nobody is found, all joints are NaN, all qualities 0 and the filter saw nothing.

        Raises:
            InvalidOutput: the network gave no maps, or a map that has a value that is not finite.
            CallFailed: nobody gave a picture; another try may.
        """
        watch = Stopwatch(self._clock)
        sight = self._look.look(pictures, filter_state, watch)
        frame = sight.frame
        with watch.stage("lift"):
            windows = windows_around(frame.depth, frame.area.inside(sight.keypoints))
            surface = self._lift(windows, sight, self._lifting)
            told = _evidence(sight) if evidence or self._lifter else None
        with watch.stage("qoe"):
            others = nearest_cells(sight.others, sight.output.heatmaps.shape[1:]) if self._masks_others else None
            quality = quality_of_estimation(sight.output.heatmaps, _cells(sight), surface, others=others)
            calibrated = self._calibrate(surface, quality, windows, frame.camera)
        with watch.stage("lift"):
            placed = self._placed(sight, quality, told) or _Placed(surface, *calibrated, None)
        with watch.stage("filter"):
            observed = placed.points if filter_state.rule == "variance" else _seen_alone(placed.points, sight)
            updated = kalman.update(filter_state, observed, quality.combined, placed.variance)
        return PoseEstimate(
            keypoints=sight.keypoints,
            points=placed.points,
            mass=quality.mass,
            height=quality.height,
            distance=quality.distance,
            quality=quality.combined,
            filter=updated,
            heatmaps=sight.output.heatmaps if heatmaps else None,
            heatmap_area=astuple(sight.region) if heatmaps else None,
            joints=frame.joints,
            visible=frame.visible,
            timings=pictures.timings | watch.seconds,
            spread=windows.spread,
            expected_error=placed.expected_error,
            radius=placed.radius,
            readings={one: _read(self._lift(windows, sight, one), quality) for one in liftings},
            evidence=told if evidence else None,
            variance=placed.variance,
        )

    def _lift(self, windows: Windows, sight: Sight, lifting: Lifting) -> Float64Array:
        points = lift(windows, sight.keypoints, sight.frame.camera, lifting)
        return points if self._believes_all else within_reach(points)

    def _placed(self, sight: Sight, quality: Quality, told: Evidence | None) -> "_Placed | None":
        """What a learned lifter says, where there is one."""
        if self._lifter is None or told is None:
            return None
        lifted = self._lifter.lift(sight.keypoints, quality.height, told, sight.frame.camera)
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


def _seen_alone(points: Float64Array, sight: Sight) -> Float64Array:
    """(18, 3) the points of the joints that were found."""
    return np.where(np.isfinite(sight.keypoints[:, :1]), points, np.nan)


def _evidence(sight: Sight) -> Evidence:
    frame = sight.frame
    return evidence_of(frame.depth, frame.area.inside(sight.keypoints), frame.camera.intrinsics.fx)


def _read(points: Float64Array, quality: Quality) -> Reading:
    distance = distance_quality(points)
    return Reading(points=points, distance=distance, quality=(quality.mass + quality.height + distance) / 3)


def _cells(sight: Sight) -> NDArray[np.int64]:
    """(18, 2) row and column of each keypoint in the heatmaps, -1 where there is none."""
    return heatmap_cells(sight.region.inside(sight.keypoints), sight.region.shape, sight.output.heatmaps.shape[1:])
