"""A frame and a filter in, an observation out: the whole pipeline, without a socket."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import msgspec
import numpy as np
from numpy.typing import NDArray

from perception_worker import kalman
from perception_worker.calibration import Calibrated, Calibration
from perception_worker.lifting import Windows, lift, windows_around
from perception_worker.network import Network, NetworkOutput
from perception_worker.qoe import Quality, distance_quality, heatmap_cells, nearest_cells, quality_of_estimation
from perception_worker.region import around_person
from perception_worker.stopwatch import Clock, Stopwatch
from protocol.arrays import Float64Array, UInt8Array
from protocol.camera import Camera
from protocol.config import PerceptionConfig, Profile, settled
from protocol.frame import Frame
from protocol.observation import FilterState, Lifting, Observation, Reading
from protocol.region import Region

LEAST_TO_CROP = 3
"""Joints that a look at a frame must find to be believed: fewer are nobody to look closer at, or somebody lost."""


@dataclass(frozen=True, eq=False)
class _Sight:
    """What the network saw in a part of a frame.

    Attributes:
        keypoints: (18, 2) of the person, in the frame's pixels.
        others: (n, 18, 2) of other people, in the heatmaps' cells, column and row.
    """

    region: Region
    output: NetworkOutput
    keypoints: Float64Array
    others: Float64Array


class Perceiver:
    """Estimates one person's pose and how sure it is; may be called by several threads at once."""

    def __init__(
        self,
        network: Network,
        config: PerceptionConfig,
        *,
        profile: Profile = "vantage",
        calibration: Calibration | None = None,
        clock: Clock = time.perf_counter,
    ) -> None:
        config = settled(config, profile)
        self._network = network
        self._lifting: Lifting = cast("Lifting", config.lifting)
        self._crop = config.crop
        self._calibration = calibration
        self._masks_others = config.mask == "skeleton"
        self._clock = clock

    def perceive(
        self, frame: Frame, filter_state: FilterState, *, heatmaps: bool = False, liftings: Sequence[Lifting] = ()
    ) -> Observation:
        """Estimate the pose in a frame.

        Args:
            frame: an RGB-D picture; its true joints, where it has any, are passed on.
            filter_state: the filter before this frame.
            heatmaps: whether the observation is to carry the network's heatmaps.
            liftings: ways of lifting whose readings it is to carry.

        Returns:
            The observation; where nobody is found, all joints are NaN, all qualities 0 and the filter saw nothing.

        Raises:
            InvalidOutput: the network gave no maps, or a map that has a value that is not finite.
        """
        watch = Stopwatch(self._clock)
        sight = self._look(frame.rgb, watch)
        with watch.stage("lift"):
            windows = windows_around(frame.depth, sight.keypoints)
            points = lift(windows, sight.keypoints, frame.camera, self._lifting)
        with watch.stage("qoe"):
            others = nearest_cells(sight.others, sight.output.heatmaps.shape[1:]) if self._masks_others else None
            quality = quality_of_estimation(sight.output.heatmaps, _cells(sight), points, others=others)
            calibrated = self._calibrate(points, quality, windows, frame.camera)
        with watch.stage("filter"):
            updated = kalman.update(filter_state, points, quality.combined)
        return Observation(
            keypoints=sight.keypoints,
            points=points,
            mass=quality.mass,
            height=quality.height,
            distance=quality.distance,
            quality=quality.combined,
            filter=updated,
            heatmaps=sight.output.heatmaps if heatmaps else None,
            heatmap_area=msgspec.structs.astuple(sight.region) if heatmaps else None,
            joints=frame.joints,
            visible=frame.visible,
            timings=watch.seconds,
            spread=windows.spread,
            expected_error=calibrated and calibrated.expected_error,
            radius=calibrated and calibrated.radius,
            readings={one: _read(one, windows, sight, quality, frame.camera) for one in liftings},
        )

    def _calibrate(self, points: Float64Array, quality: Quality, windows: Windows, camera: Camera) -> Calibrated | None:
        return self._calibration and self._calibration.calibrate(
            points,
            mass=quality.mass,
            height=quality.height,
            distance=quality.distance,
            spread=windows.spread,
            camera=camera.pose.position,
        )

    def _look(self, rgb: UInt8Array, watch: Stopwatch) -> _Sight:
        whole = Region.whole(*rgb.shape[:2])
        sight = self._look_at(whole, rgb, watch)
        if self._crop == "none" or _found(sight) < LEAST_TO_CROP:
            return sight
        rows, columns = self._network.input_size
        closer = around_person(sight.keypoints, whole, aspect=columns / rows)
        if closer == whole:
            return sight
        second = self._look_at(closer, rgb, watch)
        return second if _found(second) >= LEAST_TO_CROP else sight

    def _look_at(self, region: Region, rgb: UInt8Array, watch: Stopwatch) -> _Sight:
        with watch.stage("infer"):
            output = self._network.infer(region.part(rgb))
        with watch.stage("decode"):
            people = self._network.decode(output)
            keypoints = region.pixels(people.person, output.heatmaps.shape[1:])
        return _Sight(region, output, keypoints, people.others)


def _read(lifting: Lifting, windows: Windows, sight: _Sight, quality: Quality, camera: Camera) -> Reading:
    points = lift(windows, sight.keypoints, camera, lifting)
    distance = distance_quality(points)
    return Reading(points=points, distance=distance, quality=(quality.mass + quality.height + distance) / 3)


def _found(sight: _Sight) -> int:
    return int(np.isfinite(sight.keypoints[:, 0]).sum())


def _cells(sight: _Sight) -> NDArray[np.int64]:
    """(18, 2) row and column of each keypoint in the heatmaps, -1 where there is none."""
    size = (sight.region.height, sight.region.width)
    return heatmap_cells(sight.region.inside(sight.keypoints), size, sight.output.heatmaps.shape[1:])
