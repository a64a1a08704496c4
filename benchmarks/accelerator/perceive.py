"""Perceive rendered frames with the network on one engine; a process of `benchmarks.accelerator`."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.accelerator.engines import open_on
from benchmarks.accelerator.measured import Measured, hand_over, load_arrays, options_of, save_arrays
from benchmarks.accelerator.render import views
from perception_worker.calibration.choice import open_calibration
from perception_worker.network import Network
from perception_worker.perceive import Perceiver
from protocol.config import RunConfig, settled
from protocol.frame import Frame
from protocol.observation import FilterState, Observation


def frames_of(file: Path, count: int) -> Iterator[tuple[Frame, FilterState]]:
    """The views that `render` kept, each with a filter that knows where the person stands and no more."""
    kept, height = load_arrays(file), RunConfig().environment.target_height
    for (scene, camera), rgb, depth in zip(views(count), kept["rgb"], kept["depth"], strict=True):
        yield Frame(rgb=rgb, depth=depth, camera=camera), FilterState.initial((*scene.position, height))


def observed(network: Network, frames: Iterator[tuple[Frame, FilterState]]) -> list[Observation]:
    """Every frame looked at twice, the second time with a filter that has seen the person, as in a flight."""
    config = RunConfig()
    perception = settled(config.perception, config.profile)
    perceiver = Perceiver(network, perception, calibration=open_calibration(perception))
    found: list[Observation] = []
    for frame, fresh in frames:
        known = perceiver.perceive(frame, fresh).filter
        found.append(perceiver.perceive(frame, known, heatmaps=True))
    return found


def arrays_of(observations: Sequence[Observation]) -> dict[str, NDArray[Any]]:
    """What is compared of observations, one after the other."""
    return {
        "heatmaps": np.stack([one.heatmaps for one in observations if one.heatmaps is not None]),
        "keypoints": np.stack([one.keypoints for one in observations]),
        "points": np.stack([one.points for one in observations]),
        "quality": np.stack([one.quality for one in observations]),
        "filter_mean": np.stack([one.filter.mean for one in observations]),
        "filter_variance": np.stack([one.filter.variance for one in observations]),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and hand over."""
    options = options_of(arguments, __doc__)
    cv2.setNumThreads(1)
    opened = open_on(options.device)
    observations = observed(opened.network, frames_of(options.frames, options.count))
    stages = observations[0].timings
    hand_over(
        Measured(
            device=opened.device,
            on_gpu=opened.on_gpu,
            seconds={stage: [one.timings[stage] for one in observations] for stage in stages},
            digests=save_arrays(options.arrays, arrays_of(observations)),
        )
    )


if __name__ == "__main__":
    main()
