"""The two detectors: one shows the network the whole frame, one the region where the person is expected or supposed.

Which part of the picture is used follows from the request alone, from its camera and its filter: any worker, any retry
and any resumed run uses the same part and gives the same bytes.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from perception_worker.detection.detection import Detection, detect
from perception_worker.detection.expectation import LEAST_JOINTS, Expectation, expected_at, expected_by, supposed_by
from perception_worker.detection.pictures import Pictures
from perception_worker.detection.region import around_person, at_inner_edge
from perception_worker.networks.network import Network
from perception_worker.stopwatch import Stopwatch
from protocol.frame import Frame
from protocol.pose_estimate import FilterState
from protocol.skeleton import JOINT_COUNT

_ENOUGH_JOINTS = 6
"""Joints of a person found in a part that is shown small. With fewer, more of the frame is shown, or a part larger."""


class Detector(Protocol):
    """Finds a person in a camera's picture; may be called by several threads at once."""

    def detect(self, pictures: Pictures, filter_state: FilterState, stopwatch: Stopwatch) -> Detection:
        """Run the network as often as needed.

        Raises:
            InvalidOutput: a network gave no maps, or a map that has a value that is not finite.
            CallFailed: no picture came; another try may succeed.
        """
        ...


class WholeFrameDetector:
    """Shows the network every frame whole, and accepts the network's choice of the person."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def detect(self, pictures: Pictures, filter_state: FilterState, stopwatch: Stopwatch) -> Detection:
        """Run the network once; raises as `Detector.detect`."""
        return detect(pictures.part(pictures.area), pictures.area, self._network, stopwatch)


class TrackingDetector:
    """Shows the network the region where the filter expects the person, and takes the skeleton that fits.

    A filter that knows no person yet still tells where to begin; a person found there is detected again in a closer
    region.

    The whole frame is searched where too few joints were found that way; where the region would be most of the frame;
    and where of a known person too few joints are found, or one lies at the region's edge. A person found in the whole
    frame is detected again in a closer region; where too few joints are found, the next network searches.

    Args:
        searching: the networks for whole frames, one or more, in the order in which they search: the smallest input
            first.
        closer: the network for regions.
    """

    def __init__(self, searching: Sequence[Network], closer: Network) -> None:
        self._searching = searching
        self._closer = closer
        rows, columns = closer.input_size
        self._aspect = columns / rows

    def detect(self, pictures: Pictures, filter_state: FilterState, stopwatch: Stopwatch) -> Detection:
        """Run a network once, and twice or three times where needed; raises as `Detector.detect`."""
        expectation = expected_by(filter_state, pictures.camera)
        if expectation is None:
            found = self._find(pictures, supposed_by(filter_state, pictures.camera), stopwatch)
        else:
            found = self._follow(pictures, expectation, stopwatch)
        return found or self._search(pictures, expectation, stopwatch)

    def _follow(self, pictures: Pictures, expectation: Expectation, stopwatch: Stopwatch) -> Detection | None:
        """The person where they are expected; None where that region may not hold all of them."""
        region = expectation.region(pictures.area, self._aspect)
        if region is None:
            return None
        detection = detect(pictures.part(region), region, self._closer, stopwatch, expectation)
        if detection.found < LEAST_JOINTS or at_inner_edge(detection.keypoints, region, pictures.area, detection.cell):
            return None
        return detection

    def _find(self, pictures: Pictures, supposed: Expectation, stopwatch: Stopwatch) -> Detection | None:
        """The person where the filter begins, detected closer; None where too few joints are found there."""
        region = supposed.region(pictures.area, self._aspect)
        if region is None:
            return None
        detection = detect(pictures.part(region), region, self._closer, stopwatch, supposed)
        if detection.found < _ENOUGH_JOINTS:
            return None
        closer = self._detect_closer(pictures, detection, stopwatch)
        return closer if closer and closer.found >= _ENOUGH_JOINTS else None

    def _search(self, pictures: Pictures, expectation: Expectation | None, stopwatch: Stopwatch) -> Detection:
        """The person in the whole frame, detected closer, by as many networks as needed."""
        frame = pictures.part(pictures.area)
        first, *others = self._searching
        best = self._search_with(first, pictures, frame, expectation, stopwatch)
        for network in others:
            if best.found >= _ENOUGH_JOINTS:
                break
            detection = self._search_with(network, pictures, frame, expectation, stopwatch)
            best = max(detection, best, key=lambda one: one.found)
        return best

    def _search_with(
        self,
        network: Network,
        pictures: Pictures,
        frame: Frame,
        expectation: Expectation | None,
        stopwatch: Stopwatch,
    ) -> Detection:
        detection = detect(frame, frame.area, network, stopwatch, expectation)
        if detection.found < LEAST_JOINTS:
            return detection
        closer = self._detect_closer(pictures, detection, stopwatch)
        return closer if closer and closer.found >= LEAST_JOINTS else detection

    def _detect_closer(self, pictures: Pictures, detection: Detection, stopwatch: Stopwatch) -> Detection | None:
        """The detected person in a region of their own; None where they fill the picture."""
        region = around_person(detection.keypoints, pictures.area, self._aspect, reach=_reach_of_missing(detection))
        if region is None:
            return None
        frame = detection.frame if region.is_within(detection.frame.area) else pictures.part(region)
        expectation = expected_at(detection.keypoints, detection.cell)
        return detect(frame, region, self._closer, stopwatch, expectation)


def _reach_of_missing(detection: Detection) -> float:
    """Pixels by which a person may reach beyond the joints that were found, more so the fewer they are."""
    size = np.nanmax(detection.keypoints, axis=0) - np.nanmin(detection.keypoints, axis=0)
    return float(size.max()) * (1.0 - detection.found / JOINT_COUNT)
