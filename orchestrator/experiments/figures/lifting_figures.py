"""The figures of a learned lifter: the error of seen and unseen joints, and the uncertainty that it reports.

Ways of lifting by the surface stand beside it on the same frames, each over those of the seen joints that it located.
"""

from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import Struct

from orchestrator.experiments.figures.bootstrap import Figure, IntArray, figure, mean, quantile
from orchestrator.experiments.figures.columns import LIFTINGS
from orchestrator.experiments.figures.sample import BANDS, Sample, inferred_joints, seen_joints
from protocol.arrays import BoolArray
from protocol.scene import TEST_POSES, TRAIN_POSES
from protocol.skeleton import Joint

UNSEEN_KINDS: Mapping[str, int] = {f"kind {kind}": kind for kind in TEST_POSES if kind not in TRAIN_POSES}
"""Kinds of body pose that are kept for tests, by the words for them."""

WRISTS = [Joint.RIGHT_WRIST, Joint.LEFT_WRIST]


class SurfaceError(Struct, frozen=True, kw_only=True):
    """Metres, the mean error of a lifting by the surface over those `joints` that it located as well."""

    lifting: str
    joints: int
    error: Figure


class LiftedJoints(Struct, frozen=True, kw_only=True):
    """Joints of one sort, in one group of frames.

    Attributes:
        group: `all`, a band of distances, a kind that is kept for tests, or a family of poses.
        sort: `all` that were located; those `seen`, which is detected as well, and the `wrists` of these; and those
            `inferred`, which is located and not detected.
        joints: how many.
        share: of all joints of the group's frames; of all wrists, for wrists.
        error: mean, metres.
        radius: median, metres.
        coverage: share of joints within their radius.
        surface: the liftings by the surface, on seen joints and wrists.
    """

    noise: str
    group: str
    sort: str
    joints: int
    share: Figure
    error: Figure
    radius: Figure
    coverage: Figure
    surface: tuple[SurfaceError, ...] = ()


def lifted_joints(samples: Mapping[str, Sample]) -> Iterator[LiftedJoints]:
    """One for each noise, group and sort; none where the lifter has not learned."""
    for noise, sample in samples.items():
        if not sample.learned:
            continue
        for group, frames in groups(sample).items():
            part = sample.of(frames)
            for sort, chosen in sorts(part).items():
                yield _lifted(noise, group, sort, part, chosen)


def groups(sample: Sample) -> dict[str, BoolArray]:
    """(frames,) which frames are in each group, those without any left out."""
    distance = sample["distance"]
    found = {band: (distance >= low) & (distance < high) for band, (low, high) in BANDS.items()}
    in_kinds = sample.poses == "kinds"
    found |= {words: in_kinds & (sample["pose"] == kind) for words, kind in UNSEEN_KINDS.items()}
    found |= {str(family): sample.poses == family for family in dict.fromkeys(sample.poses[~in_kinds].tolist())}
    return {group: frames for group, frames in found.items() if frames.any()}


def sorts(sample: Sample) -> dict[str, BoolArray]:
    """(frames, 18) which joints are of each sort."""
    seen, inferred = seen_joints(sample), inferred_joints(sample)
    return {"all": seen | inferred, "seen": seen, "wrists": seen & _wrists(), "inferred": inferred}


def _wrists() -> BoolArray:
    return np.isin(np.arange(len(Joint)), WRISTS)


def _lifted(noise: str, group: str, sort: str, sample: Sample, chosen: BoolArray) -> LiftedJoints:
    person, drawn = sample.people()
    owner = np.broadcast_to(person[:, None], chosen.shape)
    possible = np.broadcast_to(_wrists() if sort == "wrists" else True, chosen.shape)
    error, radius, whose = sample["error"][chosen], sample["radius"][chosen], owner[chosen]
    return LiftedJoints(
        noise=noise,
        group=group,
        sort=sort,
        joints=len(error),
        share=figure(mean(chosen[possible], owner[possible], drawn)),
        error=figure(mean(error, whose, drawn)),
        radius=figure(quantile(radius, 0.5, whose, drawn)),
        coverage=figure(mean(error <= radius, whose, drawn)),
        surface=tuple(_surface(sample, chosen, owner, drawn)) if sort in ("seen", "wrists") else (),
    )


def _surface(sample: Sample, chosen: BoolArray, owner: IntArray, drawn: IntArray) -> Iterator[SurfaceError]:
    for lifting in LIFTINGS:
        error = sample[f"error_{lifting}"]
        both = chosen & np.isfinite(error)
        yield SurfaceError(lifting=lifting, joints=int(both.sum()), error=figure(mean(error[both], owner[both], drawn)))
