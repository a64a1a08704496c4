"""What a second person in the picture does to the quality of the first one, with and without `perception.mask`.

    python -m benchmarks.bystanders --frames 400

Test scenes with one bystander and the same scenes without, seen from all around, 1.5 to 9 m away. Compared are views
with the bystander in the picture and nobody hidden by them, in which the person was told from the bystander, and of
these the visible joints that were found at the same place in both.
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

from benchmarks.machine import machine_kind
from benchmarks.viewpoints import all_views
from orchestrator.view import camera_at
from perception_worker.backend import open_network
from perception_worker.network import Network, NetworkOutput, People
from perception_worker.perceive import Perceiver
from protocol.arrays import BoolArray, Float64Array, UInt8Array
from protocol.camera import Camera, project
from protocol.config import RunConfig
from protocol.messages import Render
from protocol.observation import FilterState, Observation
from protocol.scene import Scene
from protocol.skeleton import Joint
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

OWN_SHARE = 0.15
"""Of the body's height in pixels: keypoints that are nearer to the truth than this, at the median, are the person's."""

SAME_PLACE = 16.0
"""Pixels: a cell of the heatmap."""

CLIP = 1.0
"""Metres, at which errors are clipped."""


class Look(NamedTuple):
    """One view, seen four ways."""

    scene: Scene
    camera: Camera
    alone: Observation
    alone_masked: Observation
    both: Observation
    both_masked: Observation


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
        """What the network gave or gives; raises as it does."""
        if self._last is None or not np.array_equal(self._last[0], rgb):
            self._last = rgb.copy(), self._network.infer(rgb)
        return self._last[1]

    def decode(self, output: NetworkOutput) -> People:
        """As the network does."""
        return self._network.decode(output)


def looks(frames: int) -> Iterator[Look]:
    """Every view: each picture is seen once, and judged without the mask and with it."""
    config = RunConfig()
    network = Once(open_network(config.perception))
    perceivers = [Perceiver(network, replace(config.perception, mask=mask)) for mask in ("none", "skeleton")]
    with closing(open_renderer(config.render)) as renderer:
        for seed, viewpoint in zip(range(frames), all_views(seed=0, farthest=9.0), strict=False):
            scene = sample_scene(seed, "test", bystanders=1)
            camera = camera_at(viewpoint, scene, config.environment)
            before = FilterState.initial((*scene.position, config.environment.target_height))
            seen: list[Observation] = []
            for shown in (replace(scene, bystanders=()), scene):
                frame = renderer.render(Render(scene=shown, camera=camera, truth=True))
                seen += [perceiver.perceive(frame, before) for perceiver in perceivers]
            yield Look(scene, camera, *seen)


def is_in_picture(look: Look) -> bool:
    """Whether the middle of the bystander's body is."""
    [bystander] = look.scene.bystanders
    [[x, y, distance]] = project(np.array([[*bystander.position, 1.0]]), look.camera)
    size = look.camera.intrinsics
    return bool(distance > 0 and 0 <= x < size.width and 0 <= y < size.height)


def is_hiding(look: Look) -> bool:
    """Whether the bystander hides a joint."""
    return bool((look.alone.visible != look.both.visible).any())


def is_of_person(camera: Camera, observation: Observation) -> bool:
    """Whether the keypoints are the person's, and not the bystander's or nobody's."""
    truth = _truth(observation)
    pixels = project(truth, camera)
    height = camera.intrinsics.fy * truth[Joint.NOSE, 2] / pixels[Joint.NOSE, 2]
    away = np.linalg.norm(observation.keypoints - pixels[:, :2], axis=1)
    found = away[np.isfinite(away)]
    return len(found) > 0 and bool(np.median(found) < OWN_SHARE * height)


def compared_joints(look: Look) -> BoolArray:
    """(18,) joints that are visible, and found at the same place with the bystander and without."""
    away = np.linalg.norm(look.alone.keypoints - look.both.keypoints, axis=1)
    return np.asarray(look.both.visible, dtype=bool) & (away < SAME_PLACE)


def figures(
    observations: Iterable[Observation], references: Iterable[Observation], joints: Sequence[BoolArray]
) -> Figures:
    """The figures over the chosen joints of each observation."""
    rows = [
        np.stack([one.mass, reference.mass, one.quality, np.linalg.norm(one.points - _truth(one), axis=1)])[:, chosen]
        for one, reference, chosen in zip(observations, references, joints, strict=True)
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


def _truth(observation: Observation) -> Float64Array:
    if observation.joints is None:
        raise ValueError("the observation came without the truth that was asked for")
    return observation.joints


def report(found: Sequence[Look]) -> Iterator[str]:
    """What was seen, line by line."""
    in_picture = [look for look in found if is_in_picture(look)]
    clear = [look for look in in_picture if not is_hiding(look) and is_of_person(look.camera, look.alone)]
    compared = [look for look in clear if is_of_person(look.camera, look.both)]
    yield (
        f"{len(found)} views; the bystander in the picture in {len(in_picture)}; nothing hidden by them and the person "
        f"found without them in {len(clear)}; the person still taken for the person with them there in {len(compared)}"
    )
    joints = [compared_joints(look) for look in compared]
    alone = [look.alone for look in compared]
    yield "\n| | mass | its shift | shifted by over 0.1 | quality | ρ with the error |\n|---|---:|---:|---:|---:|---:|"
    for name, observations in (
        ("alone", alone),
        ('with a bystander, `mask = "none"`', [look.both for look in compared]),
        ('with a bystander, `mask = "skeleton"`', [look.both_masked for look in compared]),
    ):
        row = figures(observations, alone, joints)
        yield (
            f"| {name} | {row.mass:.3f} | {row.shift:.3f} | {row.shifted:.1%} | {row.quality:.3f} "
            f"| {row.correlation:.2f} |"
        )
    changes = [np.abs(look.alone.quality - look.alone_masked.quality) for look in found]
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
        track(looks(options.frames), total=options.frames, console=Console(stderr=True), description="looking")
    )
    console.print(f"machine: {machine_kind()}", markup=False)
    for line in report(found):
        console.print(line, markup=False)


if __name__ == "__main__":
    main()
