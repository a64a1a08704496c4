"""Perceive rendered frames with the network on one engine; a process of `benchmarks.accelerator`."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from benchmarks.accelerator.engines import Opened, open_on
from benchmarks.accelerator.measured import Measured, hand_over, load_arrays, options_of, save_arrays
from benchmarks.accelerator.render import views
from perception_worker.calibration.choice import open_calibration
from perception_worker.detection import Detector
from perception_worker.perceive import Perceiver
from protocol.config import PerceptionConfig, RunConfig, settled
from protocol.frame import Frame
from protocol.pose_estimate import FilterState, PoseEstimate

STAGES = ("infer", "decode", "lift", "qoe", "filter")

_MOST_CELLS = 64
"""Rows and columns of heatmaps at most, of all the sizes that the network is given here."""


def frames_of(file: Path, count: int) -> Iterator[tuple[Frame, FilterState]]:
    """The views that `render` kept, each with a filter that knows where the person stands and no more."""
    kept, height = load_arrays(file), RunConfig().environment.target_height
    for (scene, camera), rgb, depth in zip(views(count), kept["rgb"], kept["depth"], strict=True):
        yield Frame(rgb=rgb, depth=depth, camera=camera), FilterState.initial((*scene.position, height))


def perceived(
    detector: Detector, config: PerceptionConfig, frames: Iterator[tuple[Frame, FilterState]]
) -> list[PoseEstimate]:
    """Every frame perceived twice, the second time with a filter that has seen the person, as in a flight."""
    perceiver = Perceiver(detector, config, calibration=open_calibration(config))
    found: list[PoseEstimate] = []
    for frame, fresh in frames:
        known = perceiver.perceive(frame, fresh).filter
        found.append(perceiver.perceive(frame, known, heatmaps=True))
    return found


def arrays_of(estimates: Sequence[PoseEstimate]) -> dict[str, NDArray[Any]]:
    """The arrays of estimates that are compared, one after the other."""
    return {
        "heatmaps": _side_by_side([one.heatmaps for one in estimates if one.heatmaps is not None]),
        "keypoints": np.stack([one.keypoints for one in estimates]),
        "points": np.stack([one.points for one in estimates]),
        "quality": np.stack([one.quality for one in estimates]),
        "filter_mean": np.stack([one.filter.mean for one in estimates]),
        "filter_variance": np.stack([one.filter.variance for one in estimates]),
    }


def _side_by_side(maps: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Heatmaps of several sizes in one array that holds the largest there may be, NaN where one is smaller."""
    held = np.full((len(maps), maps[0].shape[0], _MOST_CELLS, _MOST_CELLS), np.nan, np.float32)
    for place, one in zip(held, maps, strict=True):
        place[:, : one.shape[1], : one.shape[2]] = one
    return held


def measured_detector(
    name: Literal["track", "whole"], options: argparse.Namespace
) -> tuple[Opened, dict[str, list[float]], dict[str, NDArray[Any]]]:
    """The seconds of one detector by stage, and the arrays of its estimates; both are named for it."""
    config = RunConfig()
    perception = settled(replace(config.perception, look=name), config.profile)
    opened = open_on(options.device, perception)
    estimates = perceived(opened.detector, perception, frames_of(options.frames, options.count))
    seconds = {
        f"{stage}, {name}": [one.timings[stage] for one in estimates if stage in one.timings] for stage in STAGES
    }
    return opened, seconds, {f"{name}/{kind}": array for kind, array in arrays_of(estimates).items()}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and hand over."""
    options = options_of(arguments, __doc__)
    cv2.setNumThreads(1)
    opened, seconds, arrays = measured_detector("track", options)
    _, more_seconds, more_arrays = measured_detector("whole", options)
    hand_over(
        Measured(
            device=opened.device,
            on_gpu=opened.on_gpu,
            seconds=seconds | more_seconds,
            digests=save_arrays(options.arrays, arrays | more_arrays),
        )
    )


if __name__ == "__main__":
    main()
