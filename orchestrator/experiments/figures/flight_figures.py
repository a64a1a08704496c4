"""The figures of the flights: the filter's posterior as an uncertainty, beside those of a single frame.

All of them are compared on the same joints, those located in the frame (of a learned lifter, those detected as well);
the posterior besides on every joint that the filter has ever seen, which is where it says something that a frame can't.
"""

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
from msgspec import Struct

from orchestrator.experiments.figures.bootstrap import Figure, figure, mean
from orchestrator.experiments.figures.observation_figures import Score, score
from orchestrator.experiments.figures.posterior_figures import Posterior, posteriors
from orchestrator.experiments.figures.sample import (
    LARGEST_ERROR,
    LEARNED,
    Estimates,
    Sample,
    samples_of,
    seen_joints,
    truth_of,
)
from orchestrator.experiments.flights import PATHS
from protocol.arrays import Float64Array


class FlightError(Struct, frozen=True, kw_only=True):
    """Mean errors along the flights, metres; each joint's clipped at 1 m.

    Attributes:
        frame: of the single frame, over its located joints; inferred ones are left out.
        filtered: of the filter's mean, over the same joints.
        seen: of the filter's mean, over all joints that it has ever seen.
    """

    noise: str
    path: str
    frames: int
    frame: Figure
    filtered: Figure
    seen: Figure


class FlightFigures(Struct, frozen=True, kw_only=True):
    """The band of a score is the path, `all` for both; its uncertainty says what is held against which error.

    Posteriors are told of filters that take a learned lifter's variance: they are in metres.
    """

    flights: int
    steps: int
    lifting: str
    scores: tuple[Score, ...]
    errors: tuple[FlightError, ...]
    posteriors: tuple[Posterior, ...] = ()


def flight_figures(table: pa.Table) -> FlightFigures:
    """All figures of a table of flights."""
    samples = flown_samples(table)
    first = next(iter(samples.values()))
    lifting = str(table["lifting"][0].as_py())
    return FlightFigures(
        flights=len(np.unique(np.concatenate([one["flight"] for one in samples.values()]))),
        steps=int(first["step"].max()) + 1,
        lifting=lifting,
        scores=tuple(_scores(samples)),
        errors=tuple(_errors(samples)),
        posteriors=tuple(posteriors(samples)) if lifting == LEARNED else (),
    )


def flown_samples(table: pa.Table) -> dict[tuple[str, str], Sample]:
    """Frames by depth noise and path, `all` for both."""
    found = {(noise, "all"): sample for noise, sample in samples_of(table).items()}
    for path in PATHS:
        chosen = pa.array([one == path for one in table["path"].cast(pa.string()).to_pylist()])
        found |= {(noise, path): sample for noise, sample in samples_of(table.filter(chosen)).items()}
    return found


def comparisons(sample: Sample) -> dict[str, Estimates]:
    """Uncertainties, each against an error."""
    truth, frame = truth_of(sample), _points(sample, "")
    located = seen_joints(sample)
    filtered = _points(sample, "filter_")
    seen, deviation = sample["seen"] > 0, sample["deviation"]
    frames = {"1 − quality": (1.0 - sample["quality"], 1.0)}
    if np.isfinite(sample["expected_error"]).any():
        frames["expected error"] = (sample["expected_error"], LARGEST_ERROR)
    frames["posterior deviation"] = (deviation, LARGEST_ERROR)
    found = {}
    for error, points in (("frame's error", frame), ("filter's error", filtered)):
        for name, (uncertainty, missing) in frames.items():
            chosen = np.where(located, uncertainty, np.nan)
            found[f"{name} → {error}"] = Estimates(chosen, points, truth, missing, wrong=sample.wrong)
    everything = Estimates(np.where(seen, deviation, np.nan), filtered, truth, LARGEST_ERROR, wrong=sample.wrong)
    return found | {"posterior deviation → filter's error, all joints seen": everything}


def _scores(samples: dict[tuple[str, str], Sample]) -> Iterator[Score]:
    for (noise, path), sample in samples.items():
        person, drawn = sample.people()
        for name, estimates in comparisons(sample).items():
            yield score(noise, path, name, estimates, person, drawn)


def _errors(samples: dict[tuple[str, str], Sample]) -> Iterator[FlightError]:
    for (noise, path), sample in samples.items():
        person, drawn = sample.people()
        owner = np.broadcast_to(person[:, None], sample["error"].shape)
        located, seen = seen_joints(sample), sample["seen"] > 0
        filtered = np.minimum(sample["filter_error"], LARGEST_ERROR)
        frame = np.minimum(sample["error"], LARGEST_ERROR)
        yield FlightError(
            noise=noise,
            path=path,
            frames=len(sample),
            frame=figure(mean(frame[located], owner[located], drawn)),
            filtered=figure(mean(filtered[located], owner[located], drawn)),
            seen=figure(mean(filtered[seen], owner[seen], drawn)),
        )


def _points(sample: Sample, prefix: str) -> Float64Array:
    return np.stack([sample[f"{prefix}{axis}"] for axis in "xyz"], axis=2)
