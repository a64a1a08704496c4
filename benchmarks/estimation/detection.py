"""The share of visible joints that the pose network finds on our renders.

    python -m benchmarks.estimation.detection --frames 200

Test identities, 1.5 to 4 m away, the front half, each seen from a step before as well. A visible joint is found if its
keypoint lies within 5% of the body's height in pixels. The true nose's height above the ground stands for the body's,
which makes the test stricter.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from benchmarks.estimation.viewpoints import front_views, observe_requests, requests_before
from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import open_display
from orchestrator.pictures.worker_pair import worker_pair
from protocol.arrays import BoolArray, Float64Array
from protocol.camera import project
from protocol.config import PerceptionConfig, RunConfig
from protocol.errors import InvalidInput
from protocol.messages import Observe
from protocol.pose_estimate import PoseEstimate
from protocol.skeleton import Joint
from protocol.system.stop_request import stop_on_signals

TOLERANCE = 0.05
"""Of the body's height in pixels."""

_PAIRS = [(joint, Joint[joint.name.replace("RIGHT", "LEFT")]) for joint in Joint if joint.name.startswith("RIGHT")]


class Finding(Struct, frozen=True, eq=False):
    """One frame against its truth, a value for each of the 18 joints.

    Attributes:
        visible: whether the camera sees it.
        found: whether its keypoint is where it is.
        swapped: whether its keypoint is nearer to its mirror joint, in a frame where both were detected.
        quality: in [0, 1].
    """

    visible: BoolArray
    found: BoolArray
    swapped: BoolArray
    quality: Float64Array


class Detection(Struct, frozen=True):
    """Shares over all frames."""

    frames: int
    found_of_visible: float
    detected_of_visible: float
    swapped_of_visible: float
    quality_of_visible: float
    quality_of_hidden: float


def finding(request: Observe, estimate: PoseEstimate) -> Finding:
    """Compare an estimate with the truth that came with it.

    Raises:
        InvalidInput: no truth came.
    """
    if estimate.joints is None or estimate.visible is None:
        raise InvalidInput("the estimate has no truth to compare it with")
    truth = project(estimate.joints, request.camera)
    nose = estimate.joints[Joint.NOSE]
    body_height = request.camera.intrinsics.fy * nose[2] / truth[Joint.NOSE, 2]
    miss = np.linalg.norm(estimate.keypoints - truth[:, :2], axis=1)
    return Finding(
        visible=estimate.visible,
        found=miss <= TOLERANCE * body_height,
        swapped=_swapped(estimate.keypoints, truth[:, :2]),
        quality=estimate.quality,
    )


def _swapped(keypoints: Float64Array, truth: Float64Array) -> BoolArray:
    mirrored = truth.copy()
    for right, left in _PAIRS:
        mirrored[[right, left]] = truth[[left, right]]
    nearer_to_mirror = np.linalg.norm(keypoints - mirrored, axis=1) < np.linalg.norm(keypoints - truth, axis=1)
    both = np.zeros(len(keypoints), dtype=bool)
    for right, left in _PAIRS:
        both[[right, left]] = bool(np.isfinite(keypoints[[right, left]]).all())
    return nearer_to_mirror & both


def detection(findings: Sequence[Finding]) -> Detection:
    """The shares over all frames."""
    visible, found, swapped = (
        np.stack([getattr(one, name) for one in findings]) for name in ("visible", "found", "swapped")
    )
    quality = np.stack([one.quality for one in findings])
    return Detection(
        frames=len(findings),
        found_of_visible=float(found[visible].mean()),
        detected_of_visible=float((quality[visible] > 0).mean()),
        swapped_of_visible=float(swapped[visible].mean()),
        quality_of_visible=float(quality[visible].mean()),
        quality_of_hidden=float(quality[~visible].mean()),
    )


def per_joint(findings: Sequence[Finding]) -> dict[Joint, float]:
    """Share found of each joint, where it was visible."""
    visible = np.stack([one.visible for one in findings])
    found = np.stack([one.found for one in findings])
    return {joint: float(found[visible[:, joint], joint].mean()) for joint in Joint if visible[:, joint].any()}


def measure(frames: int, config: RunConfig, console: Console) -> list[Finding]:
    """Render, perceive and compare."""
    with (
        stop_on_signals() as stop,
        open_display(console) as display,
        worker_pair(config, display=display, stop=stop) as pair,
    ):
        requests = list(observe_requests(pair, front_views(seed=0), frames, config.environment))
        befores = pair.perceiver.map(requests_before(requests, config.environment, seed=0))
        requests = [replace(request, filter=seen.filter) for request, seen in zip(requests, befores, strict=True)]
        return [
            finding(request, answer) for request, answer in zip(requests, pair.perceiver.map(requests), strict=True)
        ]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.estimation.detection", description=__doc__)
    parser.add_argument("--frames", type=int, default=200)
    parser.add_argument("--look", choices=["whole", "track"], default="track")
    options = parser.parse_args()
    config = RunConfig(perception=PerceptionConfig(look=options.look))
    findings = measure(options.frames, config, Console(stderr=True))
    found = detection(findings)
    console = Console()
    console.print(f"machine: {machine_kind()}")
    console.print(f"{found.frames} frames of test identities, 1.5 to 4 m away, front half, look: {options.look}")
    console.print(f"visible joints found within 5% of the body's height: {found.found_of_visible:.1%}")
    console.print(f"visible joints detected anywhere: {found.detected_of_visible:.1%}")
    console.print(f"visible joints taken for their mirror joint: {found.swapped_of_visible:.1%}")
    console.print(f"mean quality: visible {found.quality_of_visible:.2f}, hidden {found.quality_of_hidden:.2f}")
    console.print(", ".join(f"{joint.name.lower()} {share:.0%}" for joint, share in per_joint(findings).items()))


if __name__ == "__main__":
    main()
