"""The two ways of looking: at the whole frame, or where the person is expected or supposed.

What is looked at follows from the request alone, from its camera and its filter: any worker, any retry and any resumed
run looks at the same part and gives the same bytes.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from perception_worker.look.expectation import LEAST_JOINTS, Expectation, expected_at, expected_by, supposed_by
from perception_worker.look.pictures import Pictures
from perception_worker.look.region import around_person, at_inner_edge
from perception_worker.look.sight import Sight, look_at
from perception_worker.networks.network import Network
from perception_worker.stopwatch import Stopwatch
from protocol.frame import Frame
from protocol.pose_estimate import FilterState
from protocol.skeleton import JOINT_COUNT

_ENOUGH_JOINTS = 6
"""Joints of somebody who is found in a part that is seen small; for fewer more of the frame is seen, or larger."""


class Look(Protocol):
    """Finds a person in what a camera sees; may be called by several threads at once."""

    def look(self, pictures: Pictures, state: FilterState, watch: Stopwatch) -> Sight:
        """Look as often as it takes.

        Raises:
            InvalidOutput: a network gave no maps, or a map that has a value that is not finite.
            CallFailed: nobody gave a picture; another try may.
        """
        ...


class WholeLook:
    """Shows the network every frame whole, and takes whom it takes for the person."""

    def __init__(self, network: Network) -> None:
        self._network = network

    def look(self, pictures: Pictures, state: FilterState, watch: Stopwatch) -> Sight:
        """Look once; raises as `Look.look`."""
        return look_at(pictures.part(pictures.area), pictures.area, self._network, watch)


class TrackingLook:
    """Looks where the filter expects the person, and takes the skeleton that is theirs.

    A filter that knows nobody yet still tells where it begins to look; whoever is found there is looked at again,
    closer.

    The whole frame is looked at where too few joints were found that way, where the region would be most of the frame,
    and where too few joints of somebody known are found or one at the region's edge. Whoever is found in it is looked
    at again closer; where too few joints are found, the next network searches.

    Args:
        searching: the networks for whole frames, one or more, the one that sees them smallest first.
        closer: the network for regions.
    """

    def __init__(self, searching: Sequence[Network], closer: Network) -> None:
        self._searching = searching
        self._closer = closer
        rows, columns = closer.input_size
        self._aspect = columns / rows

    def look(self, pictures: Pictures, state: FilterState, watch: Stopwatch) -> Sight:
        """Look once, and twice or three times where it has to be; raises as `Look.look`."""
        expectation = expected_by(state, pictures.camera)
        if expectation is None:
            found = self._find(pictures, supposed_by(state, pictures.camera), watch)
        else:
            found = self._follow(pictures, expectation, watch)
        return found or self._search(pictures, expectation, watch)

    def _follow(self, pictures: Pictures, expectation: Expectation, watch: Stopwatch) -> Sight | None:
        """What is where the person is expected, if that can be all there is of them."""
        region = expectation.region(pictures.area, self._aspect)
        if region is None:
            return None
        sight = look_at(pictures.part(region), region, self._closer, watch, expectation)
        if sight.found < LEAST_JOINTS or at_inner_edge(sight.keypoints, region, pictures.area, sight.cell):
            return None
        return sight

    def _find(self, pictures: Pictures, supposed: Expectation, watch: Stopwatch) -> Sight | None:
        """Who is where the filter begins to look, seen closer; None where too little of anybody is."""
        region = supposed.region(pictures.area, self._aspect)
        if region is None:
            return None
        sight = look_at(pictures.part(region), region, self._closer, watch, supposed)
        if sight.found < _ENOUGH_JOINTS:
            return None
        closer = self._look_closer(pictures, sight, watch)
        return closer if closer and closer.found >= _ENOUGH_JOINTS else None

    def _search(self, pictures: Pictures, expectation: Expectation | None, watch: Stopwatch) -> Sight:
        """What is in the whole frame, seen closer, by as many networks as it takes."""
        frame = pictures.part(pictures.area)
        first, *others = self._searching
        best = self._search_with(first, pictures, frame, expectation, watch)
        for network in others:
            if best.found >= _ENOUGH_JOINTS:
                break
            sight = self._search_with(network, pictures, frame, expectation, watch)
            best = max(sight, best, key=lambda one: one.found)
        return best

    def _search_with(
        self, network: Network, pictures: Pictures, frame: Frame, expectation: Expectation | None, watch: Stopwatch
    ) -> Sight:
        sight = look_at(frame, frame.area, network, watch, expectation)
        if sight.found < LEAST_JOINTS:
            return sight
        closer = self._look_closer(pictures, sight, watch)
        return closer if closer and closer.found >= LEAST_JOINTS else sight

    def _look_closer(self, pictures: Pictures, sight: Sight, watch: Stopwatch) -> Sight | None:
        """Whom a look has found, alone; None where they fill the picture."""
        region = around_person(sight.keypoints, pictures.area, self._aspect, reach=_reach_of_missing(sight))
        if region is None:
            return None
        frame = sight.frame if region.is_within(sight.frame.area) else pictures.part(region)
        return look_at(frame, region, self._closer, watch, expected_at(sight.keypoints, sight.cell))


def _reach_of_missing(sight: Sight) -> float:
    """Pixels by which a person may reach beyond the joints that were found, more so the fewer they are."""
    size = np.nanmax(sight.keypoints, axis=0) - np.nanmin(sight.keypoints, axis=0)
    return float(size.max()) * (1.0 - sight.found / JOINT_COUNT)
