"""Tables in Markdown."""

import math
from collections.abc import Sequence

from orchestrator.experiments.figures.bootstrap import Figure


def table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose first column is words and whose others are figures."""
    lines = [_row(headings), _row(["---"] + ["---:"] * (len(headings) - 1)), *map(_row, rows)]
    return "\n".join(lines) + "\n"


def number(value: float, decimals: int = 2) -> str:
    """A number, or a dash where there is none."""
    return f"{value:.{decimals}f}" if math.isfinite(value) else "–"


def with_interval(figure: Figure, decimals: int = 2) -> str:
    """`0.64 [0.60, 0.68]`."""
    if not math.isfinite(figure.low):
        return number(figure.value, decimals)
    return f"{number(figure.value, decimals)} [{number(figure.low, decimals)}, {number(figure.high, decimals)}]"


def title(noise: str) -> str:
    """A kind of depth noise, as a heading."""
    return "Exact depth" if noise == "none" else f"Depth with stereo noise ({noise})"


def _row(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"
