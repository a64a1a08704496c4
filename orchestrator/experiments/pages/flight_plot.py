"""A picture of the filter's posterior along flights."""

import numpy as np
import pyarrow as pa
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.ticker import MaxNLocator

from orchestrator.experiments.figures.flight_figures import flown_samples
from orchestrator.experiments.figures.sample import LARGEST_ERROR, Sample, seen_joints
from orchestrator.experiments.flights import PATHS
from protocol.arrays import Float64Array

_LINES = {
    "deviation": ("posterior deviation", "#7030a0", "-"),
    "filter_error": ("error of the filter's mean, clipped", "#1f4e79", "-"),
    "error": ("error of the frame, clipped", "#c55a11", "--"),
}


def flights_plot(table: pa.Table) -> Picture:
    """For each path, the mean posterior deviation and both errors by the step of the flight; a row for each noise."""
    samples = flown_samples(table)
    noises = list(dict.fromkeys(noise for noise, _ in samples))
    picture = Picture(figsize=(10.0, 3.4 * len(noises) + 0.3), layout="constrained")
    rows = picture.subplots(len(noises), len(PATHS), sharex=True, sharey=True, squeeze=False)
    for row, noise in zip(rows, noises, strict=True):
        for place, path in zip(row, PATHS, strict=True):
            sample = samples[noise, path]
            _lines(place, sample)
            flights = len(np.unique(sample["flight"]))
            depth = "exact depth" if noise == "none" else f"depth noise ({noise})"
            place.set_title(f"{path}, {depth}, n = {flights} flights", fontsize=10)
        row[0].set_ylabel("mean over joints, m")
    for place in rows[-1]:
        place.set_xlabel("picture of the flight")
    # Shared by all, and so only once all have been drawn.
    rows[0][0].set_ylim(bottom=0)
    rows[0][0].xaxis.set_major_locator(MaxNLocator(integer=True))
    rows[0][0].legend(fontsize=9)
    return picture


def _lines(place: Axes, sample: Sample) -> None:
    steps = np.unique(sample["step"])
    for name, (label, shade, style) in _LINES.items():
        values = _clipped(sample, name)
        heights = [float(np.nanmean(values[sample["step"] == step])) for step in steps]
        place.plot(steps, heights, color=shade, ls=style, lw=1.5, label=label)
    place.grid(alpha=0.3)


def _clipped(sample: Sample, name: str) -> Float64Array:
    """Of joints that the filter has seen, the frame's error of those located in it; errors at most `LARGEST_ERROR`."""
    seen = sample["seen"] > 0
    values = np.where(seen & seen_joints(sample) if name == "error" else seen, sample[name], np.nan)
    return np.minimum(values, LARGEST_ERROR) if "error" in name else values
