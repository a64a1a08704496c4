"""The scores of the next view as a plot."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Picture

from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.next_view.page import GROUPS
from orchestrator.experiments.next_view.scores import NextViewScores, WayScores

_SHADES = {
    "thesis": "#1f4e79",
    "memory": "#2e8b57",
    "map": "#c55a11",
    "bound": "#e0a030",
    "baseline": "#8c8c8c",
}


def scores_plot(scores: NextViewScores) -> Picture:
    """Top-1 error and share of the possible improvement of each way, with intervals."""
    ways = [one for group in GROUPS for one in scores.ways if one.group == group]
    picture = Picture(figsize=(11.0, 0.32 * len(ways) + 1.2), layout="constrained")
    left, right = picture.subplots(1, 2, sharey=True)
    _points(left, ways, [one.error for one in ways])
    left.axvline(scores.chance, color="black", linewidth=0.8, linestyle="--")
    left.axvline(0.5, color="black", linewidth=0.8, linestyle=":")
    left.set(xlabel=f"top-1 error on test scenes (dashed: chance, {scores.chance:g}; dotted: 0.5)", xlim=(0.0, 1.0))
    _points(right, ways, [one.share for one in ways])
    right.axvline(0.0, color="black", linewidth=0.8)
    right.set(xlabel="share of the possible improvement over the centre")
    left.set_yticks(range(len(ways)), [one.method for one in ways], fontsize=8)
    left.invert_yaxis()
    return picture


def _points(place: Axes, ways: list[WayScores], figures: list[Figure]) -> None:
    for row, (one, found) in enumerate(zip(ways, figures, strict=True)):
        reach = np.array([[found.value - found.low], [found.high - found.value]])
        place.errorbar(found.value, row, xerr=reach, fmt="o", color=_SHADES[one.group], markersize=5, capsize=2)
    place.grid(alpha=0.3, axis="x")
