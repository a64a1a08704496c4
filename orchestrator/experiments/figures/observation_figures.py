"""The figures of an experiment's table: correlations, coverage and errors, each with its interval over people."""

from collections.abc import Iterator, Mapping

import numpy as np
from msgspec import Struct

from orchestrator.experiments.figures.bootstrap import Figure, IntArray, figure, mean, quantile
from orchestrator.experiments.figures.columns import LIFTINGS
from orchestrator.experiments.figures.correlation import auroc, pearson, spearman
from orchestrator.experiments.figures.frames import Frames, all_joints, located_only
from orchestrator.experiments.figures.lifting_figures import LiftedJoints
from orchestrator.experiments.figures.sample import (
    BANDS,
    LARGEST_ERROR,
    LEARNED,
    Estimates,
    Sample,
    seen_joints,
    uncertainties,
)
from protocol.arrays import Float64Array
from protocol.skeleton import Joint

FAR_OFF = 0.3
"""Metres; the share of errors beyond is told of each lifting."""


class Score(Struct, frozen=True, kw_only=True):
    """How well one uncertainty predicts the error, in one band of distances.

    Attributes:
        frames, joints: how many with a located joint, and how many located joints.
        located_raw, located_clipped: Pearson's rho of frames over their located joints, errors as they are and clipped.
        all_raw, all_clipped: the same over all 18 joints, those without a place at the centroid.
        joint_raw, joint_clipped, joint_spearman: correlations over single located joints.
        joint_auroc: of a joint's error being above `wrong`.
        wrong: metres.
    """

    noise: str
    band: str
    uncertainty: str
    frames: int
    joints: int
    located_raw: Figure
    located_clipped: Figure
    all_raw: Figure
    all_clipped: Figure
    joint_raw: Figure
    joint_clipped: Figure
    joint_spearman: Figure
    joint_auroc: Figure
    wrong: float


class Coverage(Struct, frozen=True, kw_only=True):
    """How often the radius holds the joint, of which joints and in which band, inferred ones included."""

    noise: str
    band: str
    joint: str
    joints: int
    coverage: Figure
    radius: Figure


class JointError(Struct, frozen=True, kw_only=True):
    """The error of one joint under one lifting, over the frames in which it was located; metres.

    Of a learned lifter, over those in which it was detected.

    Attributes:
        located: share of all frames.
        far_off: share of errors beyond `FAR_OFF`.
    """

    noise: str
    lifting: str
    joint: str
    located: Figure
    mean: Figure
    median: Figure
    p90: Figure
    far_off: Figure


class QoeFigures(Struct, frozen=True, kw_only=True):
    """All of an experiment's figures; `lifted` where its lifter has learned."""

    frames: int
    people: int
    split: str
    poses: str
    seed: int
    network: str
    lifting: str
    scores: tuple[Score, ...]
    coverage: tuple[Coverage, ...]
    errors: tuple[JointError, ...]
    lifted: tuple[LiftedJoints, ...] = ()


def scores(samples: Mapping[str, Sample]) -> Iterator[Score]:
    """One for each noise, band and uncertainty."""
    for noise, sample in samples.items():
        for band, bounds in BANDS.items():
            part = sample.within(bounds)
            if len(part) == 0:
                continue
            person, drawn = part.people()
            for name, estimates in uncertainties(part).items():
                yield score(noise, band, name, estimates, person, drawn)


def score(noise: str, band: str, name: str, estimates: Estimates, person: IntArray, drawn: IntArray) -> Score:
    """The figures of one uncertainty.

    Args:
        person: (frames,) who is in each frame.
        drawn: samples of people.
    """
    located, imputed = located_only(estimates), all_joints(estimates)
    chosen = estimates.located
    uncertainty, error = estimates.uncertainty[chosen], estimates.error[chosen]
    owner = np.broadcast_to(person[:, None], chosen.shape)[chosen]
    clipped = np.minimum(error, LARGEST_ERROR)
    return Score(
        noise=noise,
        band=band,
        uncertainty=name,
        frames=len(located.error),
        joints=len(error),
        located_raw=_of_frames(located, located.error, person, drawn),
        located_clipped=_of_frames(located, located.clipped, person, drawn),
        all_raw=_of_frames(imputed, imputed.error, person, drawn),
        all_clipped=_of_frames(imputed, imputed.clipped, person, drawn),
        joint_raw=figure(pearson(uncertainty, error, owner, drawn)),
        joint_clipped=figure(pearson(uncertainty, clipped, owner, drawn)),
        joint_spearman=figure(spearman(uncertainty, error, owner, drawn)),
        joint_auroc=figure(auroc(uncertainty, error > estimates.wrong, owner, drawn)),
        wrong=estimates.wrong,
    )


def coverages(samples: Mapping[str, Sample]) -> Iterator[Coverage]:
    """Of all joints in each band, and of each joint in all; none where the worker was not calibrated."""
    for noise, sample in samples.items():
        for band, bounds in BANDS.items():
            part = sample.within(bounds)
            if np.isfinite(part["radius"]).any():
                yield _coverage(noise, band, "all", part, slice(None))
        if np.isfinite(sample["radius"]).any():
            yield from (_coverage(noise, "all", words(joint), sample, slice(joint, joint + 1)) for joint in Joint)


def errors(samples: Mapping[str, Sample]) -> Iterator[JointError]:
    """Of all joints together and of each, under each lifting."""
    for noise, sample in samples.items():
        for lifting, error in _errors_by(sample).items():
            yield _joint_error(noise, lifting, "all", sample, error)
            yield from (_joint_error(noise, lifting, words(joint), sample, error[:, [joint]]) for joint in Joint)


def words(joint: Joint) -> str:
    """A joint's name for display."""
    return joint.name.lower().replace("_", " ")


def _errors_by(sample: Sample) -> dict[str, Float64Array]:
    """(frames, 18) metres under each lifting; NaN where a joint does not count as located."""
    found = {lifting: sample[f"error_{lifting}"] for lifting in map(str, LIFTINGS)}
    return found | ({LEARNED: np.where(seen_joints(sample), sample["error"], np.nan)} if sample.learned else {})


def _of_frames(frames: Frames, error: Float64Array, person: IntArray, drawn: IntArray) -> Figure:
    return figure(pearson(frames.uncertainty, error, person[frames.kept], drawn))


def _coverage(noise: str, band: str, joint: str, sample: Sample, joints: slice) -> Coverage:
    radius, error = sample["radius"][:, joints], sample["error"][:, joints]
    chosen = np.isfinite(radius) & np.isfinite(error)
    person, drawn = sample.people()
    owner = np.broadcast_to(person[:, None], chosen.shape)[chosen]
    return Coverage(
        noise=noise,
        band=band,
        joint=joint,
        joints=int(chosen.sum()),
        coverage=figure(mean(error[chosen] <= radius[chosen], owner, drawn)),
        radius=figure(mean(radius[chosen], owner, drawn)),
    )


def _joint_error(noise: str, lifting: str, joint: str, sample: Sample, error: Float64Array) -> JointError:
    located = np.isfinite(error)
    person, drawn = sample.people()
    people = np.broadcast_to(person[:, None], error.shape)
    owner, error = people[located], error[located]
    return JointError(
        noise=noise,
        lifting=lifting,
        joint=joint,
        located=figure(mean(located.ravel(), people.ravel(), drawn)),
        mean=figure(mean(error, owner, drawn)),
        median=figure(quantile(error, 0.5, owner, drawn)),
        p90=figure(quantile(error, 0.9, owner, drawn)),
        far_off=figure(mean(error > FAR_OFF, owner, drawn)),
    )
