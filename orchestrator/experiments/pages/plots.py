"""Pictures of an experiment's figures."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure as Picture
from PIL import Image

from orchestrator.experiments.figures.bootstrap import Figure, IntArray, figure, mean, people_of, samples_of_people
from orchestrator.experiments.figures.correlation import pearson
from orchestrator.experiments.figures.frames import Frames, all_joints, located_only
from orchestrator.experiments.figures.observation_figures import QoeFigures, words
from orchestrator.experiments.figures.sample import Estimates, Sample, uncertainties
from orchestrator.experiments.targets.observation_targets import CALIBRATED, THESIS
from protocol.arrays import BoolArray, Float64Array
from protocol.artifact import whole_file
from protocol.skeleton import Joint

DOTS_PER_INCH = 100
COLOURS = 64
"""Of a picture; enough for lines and dots, and a third of the bytes."""

DISTANCE_EDGES = np.array([1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.75, 9.0])
AZIMUTH_EDGES = np.array([0.0, 30, 60, 90, 120, 150, 180])
DECILES = 10
EXPECTED_AT_MOST = 1.5
"""Metres that an error counts as at most where it is expected (docs/qoe.md)."""

_SHADES = {"none": "#1f4e79", "d435i": "#c55a11"}
_WORDS = {"none": "exact depth", "d435i": "depth noise (d435i)"}
_LIFTING_SHADES = {"mean": "#8c8c8c", "median": "#e0a030", "nearest": "#1f4e79", "learned": "#2e8b57"}


def write_plots(folder: Path, samples: dict[str, Sample], figures: QoeFigures) -> None:
    """Draw everything that there is data for."""
    found = {noise: uncertainties(sample) for noise, sample in samples.items()}
    names = [name for name in (THESIS, CALIBRATED) if all(name in own for own in found.values())]
    write(folder / "scatter.png", scatter(samples, found, names))
    write(folder / "reliability.png", reliability(samples, found, names[-1]))
    write(folder / "rho.png", rho_by_place(samples, found, names))
    write(folder / "joint-errors.png", joint_errors(figures))


def write(path: Path, picture: Picture) -> None:
    """Write a picture with few colours, whole or not at all."""
    drawn = io.BytesIO()
    picture.savefig(drawn, format="png", dpi=DOTS_PER_INCH)
    with whole_file(path) as aside:
        Image.open(drawn).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(aside, optimize=True)


def scatter(samples: dict[str, Sample], found: dict[str, dict[str, Estimates]], names: Sequence[str]) -> Picture:
    """Each frame's uncertainty against its error over located joints, with the line that fits best; exact depth."""
    noise = next(iter(samples))
    picture = Picture(figsize=(4.6 * len(names) + 0.6, 4.4), layout="constrained")
    axes = np.atleast_1d(picture.subplots(1, len(names), sharey=True))
    shown = None
    for place, name in zip(axes, names, strict=True):
        frames = located_only(found[noise][name])
        distance = samples[noise]["distance"][frames.kept]
        shown = place.scatter(frames.uncertainty, frames.clipped, c=distance, s=7, alpha=0.6, cmap="viridis_r", lw=0)
        _fitted_line(place, frames)
        person = people_of(samples[noise]["identity"])
        drawn = samples_of_people(int(person.max()) + 1)
        raw = figure(pearson(frames.uncertainty, frames.error, person[frames.kept], drawn))
        clipped = figure(pearson(frames.uncertainty, frames.clipped, person[frames.kept], drawn))
        place.set_title(
            f"{_title(name)}: n = {len(frames.error)} frames\n"
            f"ρ raw {raw.value:.2f}, clipped {clipped.value:.2f} [{clipped.low:.2f}, {clipped.high:.2f}]",
            fontsize=10,
        )
        place.set_xlabel("mean expected error, m" if name == CALIBRATED else "mean of 1 − quality")
    axes[0].set_ylabel("mean error of located joints, each clipped at 1 m (m)")
    if shown is not None:
        picture.colorbar(ScalarMappable(shown.norm, shown.cmap), ax=axes.tolist(), label="distance, m")
    return picture


def reliability(samples: dict[str, Sample], found: dict[str, dict[str, Estimates]], name: str) -> Picture:
    """Joints in ten groups of rising uncertainty: their true error, and how often the radius holds them."""
    calibrated = name == CALIBRATED
    picture = Picture(figsize=(9.4 if calibrated else 5.2, 4.4), layout="constrained")
    axes = np.atleast_1d(picture.subplots(1, 2 if calibrated else 1))
    for noise, sample in samples.items():
        estimates = found[noise][name]
        chosen = estimates.located
        person = np.broadcast_to(people_of(sample["identity"])[:, None], chosen.shape)[chosen]
        uncertainty, error = estimates.uncertainty[chosen], estimates.error[chosen]
        group = _deciles(uncertainty)
        centres = np.array([uncertainty[group == one].mean() for one in range(DECILES)])
        shown = np.minimum(error, EXPECTED_AT_MOST) if calibrated else error
        _by_group(axes[0], centres, shown, group, person, noise)
        if calibrated:
            held = error <= sample["radius"][chosen]
            _by_group(axes[1], np.arange(1.0, DECILES + 1), held, group, person, noise)
    axes[0].set_title("Joints by tenths of their uncertainty", fontsize=10)
    beyond = f", above {EXPECTED_AT_MOST:g} m counted as {EXPECTED_AT_MOST:g} m" if calibrated else ""
    axes[0].set_ylabel(f"mean true error{beyond} (m)")
    axes[0].set_xlabel("mean expected error, m" if calibrated else "mean of 1 − quality")
    if calibrated:
        _diagonal(axes[0])
        axes[1].axhline(0.9, color="black", lw=1, ls="--", label="wanted")
        axes[1].set(ylim=(0.5, 1.0), xlabel="tenth of the expected error (1: surest)", ylabel="share within the radius")
        axes[1].set_xticks(range(1, DECILES + 1))
        axes[1].set_title("Coverage of the 90% radius", fontsize=10)
    for place in axes:
        place.legend(fontsize=9)
        place.grid(alpha=0.3)
    return picture


def rho_by_place(samples: dict[str, Sample], found: dict[str, dict[str, Estimates]], names: Sequence[str]) -> Picture:
    """Correlation over frames by the camera's distance and azimuth, by both definitions."""
    picture = Picture(figsize=(10.0, 3.6 * len(names) + 0.2), layout="constrained")
    rows = picture.subplots(len(names), 2, sharey=True, squeeze=False)
    for row, name in zip(rows, names, strict=True):
        for place, column, edges in zip(row, ("distance", "azimuth"), (DISTANCE_EDGES, AZIMUTH_EDGES), strict=True):
            for noise, sample in samples.items():
                where = np.abs(sample[column])
                _rho_line(place, edges, where, sample, located_only(found[noise][name]), False, noise)
                _rho_line(place, edges, where, sample, all_joints(found[noise][name]), True, noise)
            place.set_title(f"{_title(name)}, n = {len(next(iter(samples.values())))} views", fontsize=10)
            place.axhline(0, color="black", lw=0.8)
            place.grid(alpha=0.3)
        row[0].set(xlabel="distance, m", ylabel="Pearson's ρ over frames", ylim=(-0.4, 1.0))
        row[1].set_xlabel("azimuth from the person's front, degrees either way")
        row[1].set_xticks(AZIMUTH_EDGES)
    handles, labels = rows[0][0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9)
    return picture


def joint_errors(figures: QoeFigures) -> Picture:
    """The mean error of each joint under each lifting."""
    noises = list(dict.fromkeys(one.noise for one in figures.errors))
    picture = Picture(figsize=(10.0, 3.3 * len(noises) + 0.3), layout="constrained")
    axes = np.atleast_1d(picture.subplots(len(noises), 1, sharex=True, sharey=True))
    names = [words(joint) for joint in Joint]
    liftings = list(dict.fromkeys(one.lifting for one in figures.errors))
    # The bars of a joint share four fifths of the way to the next joint's.
    width = 0.81 / len(liftings)
    for place, noise in zip(axes, noises, strict=True):
        for number, lifting in enumerate(liftings):
            offset = (number - (len(liftings) - 1) / 2) * width
            own = [one for one in figures.errors if (one.noise, one.lifting) == (noise, lifting) and one.joint != "all"]
            found = [one.mean for one in own]
            bars = _whiskers(found)
            heights = [one.value for one in found]
            shade = _LIFTING_SHADES[lifting]
            style = {"lw": 0.8, "ecolor": "#404040"}
            beside = np.arange(len(own)) + offset
            place.bar(beside, heights, width - 0.02, yerr=bars, color=shade, label=lifting, error_kw=style)
        place.set_title(f"{_WORDS.get(noise, noise)}, n = {figures.frames} views", fontsize=10)
        place.set_ylabel("mean error, m")
        place.grid(axis="y", alpha=0.3)
    axes[0].legend(title="lifting", fontsize=9)
    axes[-1].set_xticks(range(len(names)), names, rotation=40, ha="right")
    return picture


def _title(name: str) -> str:
    return {THESIS: "Thesis's quality", CALIBRATED: "Calibrated expected error"}.get(name, name)


def _fitted_line(place: Axes, frames: Frames) -> None:
    slope, height = np.polyfit(frames.uncertainty, frames.clipped, 1)
    ends = np.array([frames.uncertainty.min(), frames.uncertainty.max()])
    place.plot(ends, slope * ends + height, color="black", lw=1.5)
    place.set_ylim(bottom=0)


def _deciles(values: Float64Array) -> IntArray:
    ranks = np.argsort(np.argsort(values, kind="stable"), kind="stable")
    return ranks * DECILES // len(values)


def _by_group(
    place: Axes, centres: Float64Array, values: Float64Array | BoolArray, group: IntArray, person: IntArray, noise: str
) -> None:
    drawn = samples_of_people(int(person.max()) + 1)
    found = [figure(mean(values[group == one], person[group == one], drawn)) for one in range(DECILES)]
    label = f"{_WORDS.get(noise, noise)}, n = {len(values)}"
    _line(place, centres, found, noise, label=label)


def _rho_line(
    place: Axes, edges: Float64Array, where: Float64Array, sample: Sample, frames: Frames, every: bool, noise: str
) -> None:
    person = people_of(sample["identity"])
    drawn, owner = samples_of_people(int(person.max()) + 1), person[frames.kept]
    group = np.digitize(where[frames.kept], edges[1:-1])
    error = frames.clipped if every else frames.error
    found = [
        figure(pearson(frames.uncertainty[group == one], error[group == one], owner[group == one], drawn))
        for one in range(len(edges) - 1)
    ]
    label = f"{'all joints, clipped' if every else 'located, raw'}: {_WORDS.get(noise, noise)}"
    # Beside each other, so that no interval hides another.
    aside = (edges[-1] - edges[0]) * 0.006 * ((noise != "none") + 2 * every - 1.5)
    _line(place, (edges[1:] + edges[:-1]) / 2 + aside, found, noise, label=label, dashed=not every)


def _line(
    place: Axes, x: Float64Array, found: Sequence[Figure], noise: str, *, label: str, dashed: bool = False
) -> None:
    place.errorbar(
        x,
        [one.value for one in found],
        yerr=_whiskers(found),
        color=_SHADES.get(noise, "black"),
        ls="--" if dashed else "-",
        marker="o",
        ms=4,
        capsize=2,
        lw=1.3,
        label=label,
    )


def _whiskers(found: Sequence[Figure]) -> Float64Array:
    pairs = [(one.value - one.low, one.high - one.value) for one in found]
    return np.maximum(np.nan_to_num(np.array(pairs).T), 0.0)


def _diagonal(place: Axes) -> None:
    end = max(place.get_xlim()[1], place.get_ylim()[1])
    place.plot([0, end], [0, end], color="black", lw=1, ls="--", label="as expected")
