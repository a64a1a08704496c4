"""Quality at the cell of a joint's peak, compared with quality at the cell that its keypoint falls into.

    python -m benchmarks.estimation.cells --scenes 500
    python -m benchmarks.estimation.cells --scenes 100 --look whole --width 80 --height 60

Test scenes from all around, 1.5 to 9 m away, four pictures of each a step apart, the filter carried on, with both kinds
of depth noise in turns. docs/decisions/0214 has the conclusion.
"""

import argparse
from collections.abc import Iterator, Sequence
from contextlib import closing
from typing import NamedTuple

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from benchmarks.estimation.viewpoints import all_views
from benchmarks.machine import machine_kind
from orchestrator.experiments.figures.bootstrap import Figure, figure, people_of, samples_of_people
from orchestrator.experiments.figures.correlation import pearson
from orchestrator.pictures.view import a_step_before, camera_at
from perception_worker import kalman
from perception_worker.calibration.choice import open_calibration
from perception_worker.detection import Detection, HeldPictures
from perception_worker.detection.choice import open_detector
from perception_worker.lifter import open_lifter
from perception_worker.lifter.evidence import evidence_of
from perception_worker.lifting import lift, windows_around, within_reach
from perception_worker.qoe import heatmap_cells, nearest_cells, quality_of_estimation
from perception_worker.stopwatch import Stopwatch
from protocol.arrays import Float64Array
from protocol.config import PerceptionConfig, RunConfig, settled
from protocol.environment_config import EnvironmentConfig
from protocol.frame import Frame
from protocol.pose_estimate import FilterState
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

PICTURES = 4
"""Of each scene."""

_FAR = 1.5
"""Metres; an error above counts as this."""


class Rated(NamedTuple):
    """(18,) each, by one way to choose cells: qualities, and what lifter and calibration make of them, in metres."""

    cells: NDArray[np.int64]
    mass: Float64Array
    height: Float64Array
    combined: Float64Array
    points: Float64Array
    radius: Float64Array
    calibrated: Float64Array


class View(NamedTuple):
    """A picture of a person, rated both ways.

    Attributes:
        error: (18,) metres of the surface in front, NaN where there is none.
        truth: (18, 3) metres.
        by: their keypoints' cells, and their peaks'.
    """

    identity: int
    error: Float64Array
    truth: Float64Array
    by: tuple[Rated, Rated]


class Pipeline:
    """Rates the joints in pictures, as a worker of the `vantage` profile."""

    def __init__(self, look: str) -> None:
        self._config = settled(replace(PerceptionConfig(), look=look), "vantage")
        self._surface = replace(self._config, lifting="nearest")
        self._detector = open_detector(self._config)
        self._lifter = open_lifter(self._config)
        self._calibration = open_calibration(self._surface)

    def view(self, identity: int, frame: Frame, filter_state: FilterState) -> tuple[View, FilterState]:
        """A picture rated both ways, and the filter after it."""
        detection = self._detector.detect(HeldPictures(frame), filter_state, Stopwatch(lambda: 0.0))
        size = detection.map_size
        inside = detection.region.inside(detection.keypoints)
        cell = np.array(detection.region.shape[::-1]) / np.array(size[::-1])
        by_keypoint = heatmap_cells(inside, detection.region.shape, size)
        by_peak = nearest_cells((inside + 0.5) / cell - 0.5, size)
        windows = windows_around(frame.depth, frame.area.inside(detection.keypoints))
        surface = within_reach(lift(windows, detection.keypoints, frame.camera, "nearest"))
        one, other = (self._rated(detection, frame, cells, surface, windows.spread) for cells in (by_keypoint, by_peak))
        truth = np.asarray(frame.joints)
        error = np.linalg.norm(surface - truth, axis=1)
        return View(identity, error, truth, (one, other)), kalman.update(filter_state, surface, one.combined)

    def _rated(
        self, detection: Detection, frame: Frame, cells: NDArray[np.int64], surface: Float64Array, spread: Float64Array
    ) -> Rated:
        others = nearest_cells(detection.others, detection.map_size)
        quality = quality_of_estimation(detection.output.heatmaps, cells, surface, others=others)
        points, radius, calibrated = np.full((18, 3), np.nan), np.full(18, np.nan), np.full(18, np.nan)
        if self._lifter is not None:
            told = evidence_of(frame.depth, frame.area.inside(detection.keypoints), frame.camera.intrinsics.fx)
            lifted = self._lifter.lift(detection.keypoints, quality.height, told, frame.camera)
            points, radius = lifted.points, lifted.radius
        if self._calibration is not None:
            calibrated = self._calibration.calibrate(
                surface,
                mass=quality.mass,
                height=quality.height,
                distance=quality.distance,
                spread=spread,
                camera=frame.camera.pose.position,
            ).radius
        return Rated(cells, quality.mass, quality.height, quality.combined, points, radius, calibrated)


def views(scenes: int, look: str, environment: EnvironmentConfig) -> Iterator[View]:
    """All pictures of all scenes, rated."""
    pipeline, rng = Pipeline(look), np.random.default_rng(0)
    with closing(open_renderer(RunConfig().render)) as renderer:
        for seed, viewpoint in zip(range(scenes), all_views(seed=0, farthest=9.0), strict=False):
            scene = sample_scene(seed, "test", 0)
            camera = replace(camera_at(viewpoint, scene, environment), depth_noise=("none", "d435i")[seed % 2])
            filter_state = FilterState.initial((0.0, 0.0, environment.target_height))
            for _ in range(PICTURES):
                frame = renderer.render(scene, camera, truth=True)
                view, filter_state = pipeline.view(scene.identity, frame, filter_state)
                yield view
                camera = a_step_before(camera, environment, rng)


def table(found: Sequence[View]) -> str:
    """Of both ways: how often they differ, means of joints, and ρ of views; and what the difference comes to."""
    ways = [[view.by[way] for view in found] for way in (0, 1)]
    cells = [np.stack([one.cells for one in way]) for way in ways]
    joints = (cells[0] >= 0).all(axis=2)
    differs = (cells[0] != cells[1]).any(axis=2) & joints
    lines = [
        f"{len(found)} pictures, {joints.sum()} joints; the cell differs in {differs.sum() / joints.sum():.1%}\n",
        "| | at the keypoint's cell | at the peak's | mean distance | 99th percentile |",
        "|---|---:|---:|---:|---:|",
    ]
    for name in ("mass", "height", "combined", "radius", "calibrated"):
        one, other = (np.stack([getattr(each, name) for each in way]) for way in ways)
        counted = joints & np.isfinite(one) & np.isfinite(other)
        if counted.any():
            away = np.abs(other - one)[counted]
            lines.append(
                f"| {name} | {one[counted].mean():.4f} | {other[counted].mean():.4f} | {away.mean():.5f} | "
                f"{np.quantile(away, 0.99):.4f} |"
            )
    lines += _placed(found, ways)
    lines.append(_correlated(found))
    return "\n".join(lines)


def _placed(found: Sequence[View], ways: list[list[Rated]]) -> list[str]:
    """The errors of the lifter's points, and the share that its radii hold."""
    truth = np.stack([view.truth for view in found])
    points = [np.stack([one.points for one in way]) for way in ways]
    placed = np.isfinite(points[0][..., 0]) & np.isfinite(points[1][..., 0])
    if not placed.any():
        return []
    errors = [np.linalg.norm(one - truth, axis=2)[placed] for one in points]
    held = [
        np.mean(error <= np.stack([one.radius for one in way])[placed]) for error, way in zip(errors, ways, strict=True)
    ]
    moved = np.linalg.norm(points[1] - points[0], axis=2)[placed]
    return [
        f"| error of lifted points, m | {errors[0].mean():.4f} | {errors[1].mean():.4f} | {moved.mean():.5f} | "
        f"{np.quantile(moved, 0.99):.4f} |",
        f"| held by their radius | {held[0]:.2%} | {held[1]:.2%} | | |",
    ]


def _correlated(found: Sequence[View]) -> str:
    """ρ of a view's mean uncertainty and its mean error, by both ways, and its difference."""
    located = np.stack([np.isfinite(view.error) & (view.by[0].cells >= 0).all(axis=1) for view in found])
    known = located.any(axis=1)
    error = _means(np.stack([np.minimum(view.error, _FAR) for view in found]), located)[known]
    person = people_of(np.array([view.identity for view in found]))[known]
    samples = samples_of_people(int(person.max()) + 1)
    by = [
        pearson(1 - _means(np.stack([view.by[way].combined for view in found]), located)[known], error, person, samples)
        for way in (0, 1)
    ]
    one, other, change = figure(by[0]), figure(by[1]), figure(by[1] - by[0])
    apart = f"{change.value:+.4f} [{change.low:+.4f}, {change.high:+.4f}]"
    return f"| ρ of views | {_written(one)} | {_written(other)} | {apart} | |"


def _means(values: Float64Array, counted: NDArray[np.bool_]) -> Float64Array:
    return np.where(counted, values, 0.0).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)


def _written(found: Figure) -> str:
    return f"{found.value:.3f} [{found.low:.3f}, {found.high:.3f}]"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.estimation.cells",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenes", type=int, default=500)
    parser.add_argument("--look", choices=["track", "whole"], default="track")
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=480)
    options = parser.parse_args()
    environment = EnvironmentConfig()
    camera = replace(environment.camera, width=options.width, height=options.height)
    rated = views(options.scenes, options.look, replace(environment, camera=camera))
    console = Console(soft_wrap=True)
    found = list(track(rated, "rating", options.scenes * PICTURES, console=Console(stderr=True)))
    console.print(f"machine: {machine_kind()}\n\n{table(found)}", markup=False)


if __name__ == "__main__":
    main()
