"""Plots of the exploration experiment: learning curves, and walks on the maps."""

import math
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture
from matplotlib.image import AxesImage
from msgspec import Struct

from orchestrator.experiments.grid.results import TrainedRun
from orchestrator.experiments.grid.variants import VARIANTS
from orchestrator.experiments.grid.walked import Walked
from orchestrator.experiments.pages.plots import write
from protocol.arrays import Float64Array
from protocol.grid.table import SIDE, GridTable
from protocol.grid.threshold import weighted_uncertainties

BIN = 25_000
"""Environment steps of one point of a curve."""

MAPS = 6
WALKS_A_MAP = 5

_SHADES = ("#1f4e79", "#c55a11", "#2e8b57", "#8c8c8c", "#7030a0", "#e0a030", "#00838f")


class _Episode(Struct, frozen=True):
    length: int
    success: bool


def write_plots(folder: Path, runs: Sequence[TrainedRun], walked: Walked, table: GridTable) -> None:
    """Draw the curves of all runs, and walks of one of them."""
    write(folder / "curves.png", curves(runs))
    write(folder / "maps.png", maps(walked, table))


def curves(runs: Sequence[TrainedRun]) -> Picture:
    """The share of the training's episodes that succeeded, by environment steps; the range over seeds is shaded."""
    picture = Picture(figsize=(9.0, 4.6), layout="constrained")
    place = picture.subplots()
    for name, shade in zip(VARIANTS, _SHADES, strict=True):
        own = [success_by_steps(run.directory.path / "episodes.jsonl") for run in runs if run.variant == name]
        if own:
            _curve(place, own, VARIANTS[name].words, shade)
    place.set(xlabel="environment steps, thousands", ylabel="share of episodes that succeed", ylim=(0.0, 1.02))
    place.grid(alpha=0.3)
    place.legend(fontsize=9, loc="lower right")
    return picture


def success_by_steps(path: Path) -> Float64Array:
    """The share of episodes that succeeded among those that ended in each `BIN` environment steps of a training."""
    decoder = msgspec.json.Decoder(_Episode)
    episodes = [decoder.decode(line) for line in path.read_bytes().splitlines()]
    ends = np.cumsum([one.length for one in episodes])
    groups = (ends - 1) // BIN
    won = np.bincount(groups, [one.success for one in episodes])
    count = np.bincount(groups)
    # The last one is not whole.
    return np.divide(won, count, out=np.full(len(count), np.nan), where=count > 0)[:-1]


def maps(walked: Walked, table: GridTable) -> Picture:
    """Walks of a policy in test environments, from starts that are far apart."""
    chosen = table.of_split("test")
    weighted = weighted_uncertainties(table)[chosen]
    picture = Picture(figsize=(10.5, 7.2), layout="constrained")
    places = picture.subplots(2, MAPS // 2, sharex=True, sharey=True).ravel()
    shown = None
    for place, number in zip(places, np.linspace(0, len(chosen) - 1, MAPS).astype(int), strict=True):
        one = table.places[chosen[number]]
        shown = draw_map(place, weighted[number], walked.threshold, one.yaw)
        for path in walked.some_paths(int(number), WALKS_A_MAP):
            draw_walk(place, path)
        place.set_title(f"identity {one.identity}, pose {one.pose}", fontsize=10)
    if shown is not None:
        picture.colorbar(shown, ax=places.tolist(), label="weighted uncertainty, 0 to 10", shrink=0.8)
    return picture


def _curve(place: Axes, own: Sequence[Float64Array], label: str, shade: str) -> None:
    whole = min(map(len, own))
    each = np.stack([curve[:whole] for curve in own])
    steps = (np.arange(whole) + 1) * BIN / 1000
    place.plot(steps, np.nanmean(each, axis=0), color=shade, lw=1.6, label=f"{label}, n = {len(own)}")
    place.fill_between(steps, np.nanmin(each, axis=0), np.nanmax(each, axis=0), color=shade, alpha=0.15, lw=0)


def draw_map(place: Axes, weighted: Float64Array, threshold: float, yaw: float) -> AxesImage:
    """Draw the map of an environment from above: where cells succeed, and where the person faces.

    Args:
        weighted: (361,) weighted uncertainty of each cell.
        yaw: radians from the x axis.
    """
    half = SIDE / 2
    shown = place.imshow(
        weighted.reshape(SIDE, SIDE),
        origin="lower",
        extent=(-half, half, -half, half),
        cmap="viridis_r",
        vmin=0,
        vmax=10,
    )
    for cell in np.flatnonzero(weighted < threshold):
        row, column = divmod(int(cell), SIDE)
        x, y = column - SIDE // 2, row - SIDE // 2
        place.plot(x + _SQUARE[0], y + _SQUARE[1], color="white", lw=1.2)
    ahead = (1.6 * math.cos(yaw), 1.6 * math.sin(yaw))
    place.annotate("", ahead, (0, 0), arrowprops={"arrowstyle": "->", "color": "white", "lw": 2})
    return shown


_SQUARE = 0.45 * np.array([[-1, 1, 1, -1, -1], [-1, -1, 1, 1, -1]])


def draw_walk(place: Axes, path: Float64Array) -> None:
    """Draw a walk (k, 2) in metres from its start, a circle, to its end, a cross."""
    place.plot(path[:, 0], path[:, 1], color="#ff7f0e", lw=1.3)
    place.plot(*path[0], marker="o", ms=4, color="#ff7f0e")
    place.plot(*path[-1], marker="X", ms=6, color="red")
