"""One run of the network on a part of a picture, and the person found there."""

from dataclasses import dataclass

import numpy as np

from perception_worker.detection.expectation import Expectation
from perception_worker.networks.network import Network, NetworkOutput
from perception_worker.stopwatch import Stopwatch
from protocol.arrays import Float64Array
from protocol.frame import Frame
from protocol.region import Region


@dataclass(frozen=True, eq=False)
class Detection:
    """The result of one run of the network.

    Attributes:
        frame: the part of the picture that was at hand; depth is read in it.
        region: the part of it that the network was shown, and that its heatmaps cover.
        keypoints: (18, 2) of the person, in pixels of the whole picture; NaN where a joint was not found.
        others: (n, 18, 2) of other people, in the heatmaps' cells, column and row.
    """

    frame: Frame
    region: Region
    output: NetworkOutput
    keypoints: Float64Array
    others: Float64Array

    @property
    def found(self) -> int:
        """How many joints were found."""
        return int(np.isfinite(self.keypoints[:, 0]).sum())

    @property
    def map_size(self) -> tuple[int, int]:
        """Rows and columns of a heatmap."""
        return self.output.map_size

    @property
    def cell(self) -> float:
        """The longer side of a heatmap's cell, in pixels of the picture."""
        rows, columns = self.map_size
        return max(self.region.height / rows, self.region.width / columns)


def detect(
    frame: Frame, region: Region, network: Network, stopwatch: Stopwatch, expectation: Expectation | None = None
) -> Detection:
    """Show the network a region of a frame.

    Args:
        expectation: the person to find; without it, the one that the network chooses.

    Raises:
        InvalidOutput: the network gave no maps, or a map that has a value that is not finite.
        InvalidInput: the frame does not show all of the region.
    """
    with stopwatch.stage("infer"):
        output = network.infer(frame.part(region).rgb)
    with stopwatch.stage("decode"):
        people = network.decode(output)
        size = output.map_size
        if expectation is not None:
            all_people = np.concatenate([people.person[None], people.others])
            people = expectation.choose(people, region.pixels(all_people, size))
        keypoints = region.pixels(people.person, size)
    return Detection(frame, region, output, keypoints, people.others)
