"""A learned lifter's figures in Markdown."""

from collections.abc import Iterator, Sequence

from orchestrator.experiments.figures.lifting_figures import LiftedJoints
from orchestrator.experiments.pages.markdown import table, title, with_interval

_INTRODUCTION = """\
Joints are *seen* where the network detected them, and *inferred* where the lifter placed them by the others; *wrists*
are seen ones. Liftings by the surface are told over those of the seen joints that they located, whose share is in
brackets. Mean errors and median radii, m; *coverage*: share within the radius that is to hold 0.9.
"""


def lifting_sections(lifted: Sequence[LiftedJoints]) -> Iterator[str]:
    """The sections of a learned lifter's figures."""
    yield "## The learned lifter\n"
    yield _INTRODUCTION
    for noise in dict.fromkeys(one.noise for one in lifted):
        yield f"{title(noise)}:\n"
        yield _table([one for one in lifted if one.noise == noise])


def _table(lifted: Sequence[LiftedJoints]) -> str:
    liftings = list(dict.fromkeys(surface.lifting for one in lifted for surface in one.surface))
    headings = ["frames, joints", "share", "error", *(f"by {one}" for one in liftings), "radius", "coverage"]
    return table(headings, [_cells(one, liftings) for one in lifted])


def _cells(one: LiftedJoints, liftings: Sequence[str]) -> list[str]:
    surface = {
        other.lifting: f"{with_interval(other.error, 3)} ({other.joints / max(one.joints, 1):.2f})"
        for other in one.surface
    }
    return [
        f"{one.group}, {one.sort}",
        with_interval(one.share),
        with_interval(one.error, 3),
        *(surface.get(lifting, "–") for lifting in liftings),
        with_interval(one.radius, 3),
        with_interval(one.coverage, 3),
    ]
