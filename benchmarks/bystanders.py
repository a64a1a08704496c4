"""What a second person in the picture does to the quality of the first one, with and without `perception.mask`.

    python -m benchmarks.bystanders --frames 400

Test scenes with one bystander and the same scenes without, seen from all around, 1.5 to 9 m away. Compared are views
with the bystander in the picture and nobody hidden by them, in which the person was told from the bystander, and of
these the visible joints that were found at the same place in both.
"""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal, NamedTuple

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from benchmarks.machine import machine_kind
from benchmarks.viewpoints import observe_requests, views_all_round
from orchestrator.live_display import open_display
from orchestrator.stop_request import stop_on_signals
from orchestrator.worker_pair import worker_pair
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import project
from protocol.config import PerceptionConfig, RunConfig
from protocol.messages import Observe
from protocol.observation import Observation
from protocol.skeleton import Joint

Mask = Literal["none", "skeleton"]

OWN_SHARE = 0.15
"""Of the body's height in pixels: keypoints that are nearer to the truth than this, at the median, are the person's."""

SAME_PLACE = 16.0
"""Pixels: a cell of the heatmap."""

CLIP = 1.0
"""Metres, at which errors are clipped."""


class Look(NamedTuple):
    """One view, seen four ways."""

    request: Observe
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


def looks(frames: int, console: Console) -> Iterator[Look]:
    """Every view, by workers without the mask and then by workers with it."""
    seen: dict[Mask, list[tuple[Observe, Observation, Observation]]] = {
        mask: list(_observed(mask, frames, console)) for mask in ("none", "skeleton")
    }
    for (request, alone, both), (_, alone_masked, both_masked) in zip(seen["none"], seen["skeleton"], strict=True):
        yield Look(request, alone, alone_masked, both, both_masked)


def _observed(mask: Mask, frames: int, console: Console) -> Iterator[tuple[Observe, Observation, Observation]]:
    config = RunConfig(perception=PerceptionConfig(mask=mask))
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        crowded = list(observe_requests(pair, views_all_round(seed=0), frames, config.environment, bystanders=1))
        lonely = [replace(one, scene=replace(one.scene, bystanders=())) for one in crowded]
        yield from zip(crowded, pair.perceiver.map(lonely), pair.perceiver.map(crowded), strict=True)


def is_in_picture(request: Observe) -> bool:
    """Whether the middle of the bystander's body is."""
    [bystander] = request.scene.bystanders
    [[x, y, distance]] = project(np.array([[*bystander.position, 1.0]]), request.camera)
    size = request.camera.intrinsics
    return bool(distance > 0 and 0 <= x < size.width and 0 <= y < size.height)


def is_hiding(look: Look) -> bool:
    """Whether the bystander hides a joint."""
    return bool((look.alone.visible != look.both.visible).any())


def is_of_person(request: Observe, observation: Observation) -> bool:
    """Whether the keypoints are the person's, and not the bystander's or nobody's."""
    truth = _truth(observation)
    pixels = project(truth, request.camera)
    height = request.camera.intrinsics.fy * truth[Joint.NOSE, 2] / pixels[Joint.NOSE, 2]
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
    in_picture = [look for look in found if is_in_picture(look.request)]
    clear = [look for look in in_picture if not is_hiding(look) and is_of_person(look.request, look.alone)]
    compared = [look for look in clear if is_of_person(look.request, look.both)]
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
    changed = sum(bool((look.alone.quality != look.alone_masked.quality).any()) for look in found)
    yield f"\nviews of one person in which the mask changes a quality: {changed} of {len(found)}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.bystanders", description=__doc__)
    parser.add_argument("--frames", type=int, default=400)
    options = parser.parse_args()
    console = Console(soft_wrap=True)
    found = list(looks(options.frames, Console(stderr=True)))
    console.print(f"machine: {machine_kind()}", markup=False)
    for line in report(found):
        console.print(line, markup=False)


if __name__ == "__main__":
    main()
