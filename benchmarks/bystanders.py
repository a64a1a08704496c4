"""Which of two people in a picture is taken for the person, and how the other one changes the person's quality.

    python -m benchmarks.bystanders --frames 400

Test scenes with one bystander and the same scenes without, seen from all around, 1.5 to 9 m away. A view is clear if
the bystander is in the picture and does not hide the person, and the person is found without the bystander. The tables
tell whose keypoints are found in clear views: in the whole frame; tracked, with the filter of a view a step before of
the person alone; and tracked from a view a step before with the bystander in it, where the filter knew no person yet.

The table of quality, with and without `perception.mask`, is of whole frames: of the clear views in which the person was
told from the bystander, the visible joints that were found at the same place in both.
"""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from contextlib import closing
from typing import NamedTuple

import cv2
import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console
from rich.progress import track

from benchmarks.estimation.viewpoints import all_views
from benchmarks.machine import machine_kind
from orchestrator.pictures.view import a_step_before, camera_at
from perception_worker.detection import WholeFrameDetector
from perception_worker.detection.choice import open_detector
from perception_worker.networks.backend import open_network
from perception_worker.networks.network import Network, NetworkOutput, People
from perception_worker.perceive import Perceiver
from protocol.arrays import BoolArray, Float64Array, UInt8Array
from protocol.camera import Camera, project
from protocol.config import RunConfig, settled
from protocol.pose_estimate import FilterState, PoseEstimate
from protocol.scene import Scene
from protocol.skeleton import Joint
from render_worker.renderer import Renderer, open_renderer
from render_worker.scenes import sample_scene

OWN_SHARE = 0.15
"""Of the body's height in pixels: keypoints that are nearer to the truth than this, at the median, are the person's."""

SAME_PLACE = 16.0
"""Pixels: a cell of the heatmap."""

CLIP = 1.0
"""Metres, at which errors are clipped."""


class View(NamedTuple):
    """One view, seen in several ways.

    Attributes:
        alone, alone_masked, both, both_masked: whole, without the bystander and with them.
        tracked_alone, tracked, tracked_from_first: tracked, without the bystander; with them, who have just come; and
            with them, who were there before any person was known.
    """

    scene: Scene
    camera: Camera
    alone: PoseEstimate
    alone_masked: PoseEstimate
    both: PoseEstimate
    both_masked: PoseEstimate
    tracked_alone: PoseEstimate
    tracked: PoseEstimate
    tracked_from_first: PoseEstimate


class Figures(Struct, frozen=True):
    """Over all compared joints.

    Attributes:
        mass, quality: means.
        shift: of mass, mean distance from what it is without the bystander; `shifted`: share that is over 0.1 away.
        correlation: Pearson's, of 1 - quality with the error in metres, clipped at 1 m, of located joints.
    """

    mass: float
    quality: float
    shift: float
    shifted: float
    correlation: float


class Once:
    """A network that is not run again for a picture that comes twice in a row."""

    def __init__(self, network: Network) -> None:
        self.input_size = network.input_size
        self._network = network
        self._last: tuple[UInt8Array, NetworkOutput] | None = None

    def infer(self, rgb: UInt8Array) -> NetworkOutput:
        """The network's output; that of the last picture is kept. Raises as the network does."""
        if self._last is None or not np.array_equal(self._last[0], rgb):
            self._last = rgb.copy(), self._network.infer(rgb)
        return self._last[1]

    def decode(self, output: NetworkOutput) -> People:
        """As the network does."""
        return self._network.decode(output)


class Perceivers:
    """Perceive scenes in all the ways that are compared; the network runs once on each whole picture."""

    def __init__(self, renderer: Renderer, config: RunConfig) -> None:
        whole = WholeFrameDetector(Once(open_network(config.perception)))
        self._whole, self._masked = (
            Perceiver(whole, replace(config.perception, mask=mask)) for mask in ("none", "skeleton")
        )
        perception = settled(replace(config.perception, look="track"), config.profile)
        self._tracking = Perceiver(open_detector(perception), perception)
        self._renderer = renderer
        self._environment = config.environment

    def view(self, scene: Scene, camera: Camera, rng: np.random.Generator) -> View:
        """One view in all ways."""
        without = replace(scene, bystanders=())
        before = a_step_before(camera, self._environment, rng)
        alone, both, before_alone, before_both = (
            self._renderer.render(shown, taken_by, truth=True)
            for taken_by in (camera, before)
            for shown in (without, scene)
        )
        nobody = FilterState.initial((*scene.position, self._environment.target_height))
        knows, first = (self._tracking.perceive(one, nobody).filter for one in (before_alone, before_both))
        whole = [one.perceive(shown, nobody) for shown in (alone, both) for one in (self._whole, self._masked)]
        tracked = [self._tracking.perceive(*each) for each in ((alone, knows), (both, knows), (both, first))]
        return View(scene, camera, *whole, *tracked)


def views(frames: int) -> Iterator[View]:
    """Every view."""
    config, rng = RunConfig(), np.random.default_rng(0)
    with closing(open_renderer(config.render)) as renderer:
        perceivers = Perceivers(renderer, config)
        for seed, viewpoint in zip(range(frames), all_views(seed=0, farthest=9.0), strict=False):
            scene = sample_scene(seed, "test", bystanders=1)
            yield perceivers.view(scene, camera_at(viewpoint, scene, config.environment), rng)


def is_in_picture(view: View) -> bool:
    """Whether the middle of the bystander's body is."""
    [bystander] = view.scene.bystanders
    [[x, y, distance]] = project(np.array([[*bystander.position, 1.0]]), view.camera)
    size = view.camera.intrinsics
    return bool(distance > 0 and 0 <= x < size.width and 0 <= y < size.height)


def is_hiding(view: View) -> bool:
    """Whether the bystander hides a joint."""
    return bool((view.alone.visible != view.both.visible).any())


def is_of_person(camera: Camera, estimate: PoseEstimate) -> bool:
    """Whether the keypoints are the person's, and not the bystander's or nobody's."""
    truth = _truth(estimate)
    pixels = project(truth, camera)
    height = camera.intrinsics.fy * truth[Joint.NOSE, 2] / pixels[Joint.NOSE, 2]
    away = np.linalg.norm(estimate.keypoints - pixels[:, :2], axis=1)
    found = away[np.isfinite(away)]
    return len(found) > 0 and bool(np.median(found) < OWN_SHARE * height)


def compared_joints(view: View) -> BoolArray:
    """(18,) joints that are visible, and found at the same place with the bystander and without."""
    away = np.linalg.norm(view.alone.keypoints - view.both.keypoints, axis=1)
    return np.asarray(view.both.visible, dtype=bool) & (away < SAME_PLACE)


def figures(
    estimates: Iterable[PoseEstimate], references: Iterable[PoseEstimate], joints: Sequence[BoolArray]
) -> Figures:
    """The figures over the chosen joints of each estimate."""
    rows = [
        np.stack([one.mass, reference.mass, one.quality, np.linalg.norm(one.points - _truth(one), axis=1)])[:, chosen]
        for one, reference, chosen in zip(estimates, references, joints, strict=True)
    ]
    mass, reference, quality, error = np.concatenate(rows, axis=1)
    located = np.isfinite(error)
    clipped = np.minimum(error[located], CLIP)
    return Figures(
        mass=float(mass.mean()),
        quality=float(quality.mean()),
        shift=float(np.abs(mass - reference).mean()),
        shifted=float((np.abs(mass - reference) > 0.1).mean()),
        correlation=float(np.corrcoef(1 - quality[located], clipped)[0, 1]),
    )


def _truth(estimate: PoseEstimate) -> Float64Array:
    if estimate.joints is None:
        raise ValueError("the estimate came without the truth that was asked for")
    return estimate.joints


def whose(views: Sequence[View], way: str) -> str:
    """Of clear views, whose the keypoints are in one of the ways."""
    seen = [(view.camera, getattr(view, way)) for view in views]
    nobody = sum(not np.isfinite(estimate.keypoints).any() for _, estimate in seen)
    own = sum(is_of_person(camera, estimate) for camera, estimate in seen)
    other = len(seen) - own - nobody
    return f"{own / len(seen):.1%} | {other / len(seen):.1%} | {nobody / len(seen):.1%}"


def report(found: Sequence[View]) -> Iterator[str]:
    """The table of keypoints, line by line."""
    in_picture = [view for view in found if is_in_picture(view) and not is_hiding(view)]
    clear = [view for view in in_picture if is_of_person(view.camera, view.alone)]
    clear_tracked = [view for view in in_picture if is_of_person(view.camera, view.tracked_alone)]
    yield f"{len(found)} views; the bystander in the picture and nothing hidden by them in {len(in_picture)}"
    yield "\n| | clear views | the person's | somebody else's | nobody's |\n|---|---:|---:|---:|---:|"
    for name, views, way in (
        ("whole", clear, "both"),
        ("tracked, the bystander has just come", clear_tracked, "tracked"),
        ("tracked, the bystander was there from the first look on", clear_tracked, "tracked_from_first"),
    ):
        yield f"| {name} | {len(views)} | {whose(views, way)} |"
    yield from quality_report(found, [view for view in clear if is_of_person(view.camera, view.both)])


def quality_report(found: Sequence[View], compared: Sequence[View]) -> Iterator[str]:
    """The table of the bystander's effect on quality, line by line."""
    joints = [compared_joints(view) for view in compared]
    alone = [view.alone for view in compared]
    yield "\n| | mass | its shift | shifted by over 0.1 | quality | ρ with the error |\n|---|---:|---:|---:|---:|---:|"
    for name, estimates in (
        ("alone", alone),
        ('with a bystander, `mask = "none"`', [view.both for view in compared]),
        ('with a bystander, `mask = "skeleton"`', [view.both_masked for view in compared]),
    ):
        row = figures(estimates, alone, joints)
        yield (
            f"| {name} | {row.mass:.3f} | {row.shift:.3f} | {row.shifted:.1%} | {row.quality:.3f} "
            f"| {row.correlation:.2f} |"
        )
    changes = [np.abs(view.alone.quality - view.alone_masked.quality) for view in found]
    changed = [change for change in changes if change.any()]
    yield (
        f"\nviews of one person in which the mask changes a quality: {len(changed)} of {len(found)}, "
        f"in all {sum(int((change > 0).sum()) for change in changed)} joints by at most {np.max(changes):.3f}"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bystanders", description=__doc__)
    parser.add_argument("--frames", type=int, default=400)
    options = parser.parse_args()
    console = Console(soft_wrap=True)
    # As the perception worker does.
    cv2.setNumThreads(1)
    found = list(
        track(views(options.frames), total=options.frames, console=Console(stderr=True), description="perceiving")
    )
    console.print(f"machine: {machine_kind()}", markup=False)
    for line in report(found):
        console.print(line, markup=False)


if __name__ == "__main__":
    main()
