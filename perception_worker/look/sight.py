"""What the network saw in a part of a picture."""

from dataclasses import dataclass

import numpy as np

from perception_worker.look.expectation import Expectation
from perception_worker.networks.network import Network, NetworkOutput
from perception_worker.stopwatch import Stopwatch
from protocol.arrays import Float64Array
from protocol.frame import Frame
from protocol.region import Region


@dataclass(frozen=True, eq=False)
class Sight:
    """What one look came to.

    Attributes:
        frame: the part of the picture that there was; depth is read in it.
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
    def cell(self) -> float:
        """The longer side of a heatmap's cell, in pixels of the picture."""
        rows, columns = self.output.heatmaps.shape[1:]
        return max(self.region.height / rows, self.region.width / columns)


def look_at(
    frame: Frame, region: Region, network: Network, watch: Stopwatch, expectation: Expectation | None = None
) -> Sight:
    """Show the network a region of a frame.

    Args:
        expectation: who is looked for; without it, whom the network takes for the person.

    Raises:
        InvalidOutput: the network gave no maps, or a map that has a value that is not finite.
        InvalidInput: the frame does not show all of the region.
    """
    with watch.stage("infer"):
        output = network.infer(frame.part(region).rgb)
    with watch.stage("decode"):
        people = network.decode(output)
        map_size = output.heatmaps.shape[1:]
        if expectation is not None:
            everybody = np.concatenate([people.person[None], people.others])
            people = expectation.choose(people, region.pixels(everybody, map_size))
        keypoints = region.pixels(people.person, map_size)
    return Sight(frame, region, output, keypoints, people.others)
