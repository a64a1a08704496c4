"""The flights' figures in Markdown."""

from collections.abc import Iterator

from orchestrator.experiments.figures.flight_figures import FlightFigures
from orchestrator.experiments.figures.posterior_figures import SETTLED
from orchestrator.experiments.figures.sample import LEARNED
from orchestrator.experiments.pages.markdown import table, with_interval

_INTRODUCTION = """\
{flights} flights of {steps} pictures: around people 3 m away, and from 6 m at their side or behind them to the point in
front of them. The filter travels along. *Posterior deviation*: the root of a joint's summed posterior variances, by the
{lifting} lifting. → says which error it is held against: that of the frame's own estimate, or of the filter's mean. All
are compared on the joints located in the frame, but the last, which is on every joint that the filter has ever seen.
*AUROC*: of an error above {wrong:.2f} m.
"""
_LEARNED = """\
The filter takes the lifter's variance for an observation's noise, of joints that it inferred as well; *located* leaves
these out.
"""


_MEANT = f"""\
What the posterior says, over all joints that the filter has seen. *Within*: errors along an axis that are no larger
than the posterior's deviation along it (0.68 of a normal distribution's are). *Coverage* and *radius*: of the sphere
that is to hold a joint with probability 0.9. *Settled*: mean error of the filter's mean from picture {SETTLED} on.
"""


def flight_sections(figures: FlightFigures) -> Iterator[str]:
    """The sections of the flights' figures."""
    yield "## The filter's posterior along flights\n"
    wrong = figures.scores[0].wrong
    introduction = _INTRODUCTION.format(
        flights=figures.flights, steps=figures.steps, lifting=figures.lifting, wrong=wrong
    )
    yield introduction + (_LEARNED if figures.lifting == LEARNED else "")
    yield _scores(figures)
    yield "Mean error, m, each joint's clipped at 1 m:\n"
    yield _errors(figures)
    if figures.posteriors:
        yield _MEANT
        yield _posteriors(figures)


def _scores(figures: FlightFigures) -> str:
    headings = [
        "",
        "depth",
        "path",
        "ρ frame, raw",
        "ρ frame, clipped",
        "ρ joint, raw",
        "ρ joint, clipped",
        "Spearman",
        "AUROC",
    ]
    rows = [
        [
            one.uncertainty,
            one.noise,
            *(
                with_interval(found)
                for found in (
                    one.located_raw,
                    one.located_clipped,
                    one.joint_raw,
                    one.joint_clipped,
                    one.joint_spearman,
                    one.joint_auroc,
                )
            ),
        ]
        for one in figures.scores
        if one.band == "all"
    ]
    return table(headings, rows)


def _errors(figures: FlightFigures) -> str:
    headings = ["depth", "path", "frames", "frame", "filter's mean, same joints", "filter's mean, all joints seen"]
    rows = [
        [
            one.noise,
            one.path,
            str(one.frames),
            with_interval(one.frame, 3),
            with_interval(one.filtered, 3),
            with_interval(one.seen, 3),
        ]
        for one in figures.errors
    ]
    return table(headings, rows)


def _posteriors(figures: FlightFigures) -> str:
    headings = ["depth", "path", "within", "coverage", "mean radius, m", "settled, m"]
    rows = [
        [
            one.noise,
            one.path,
            with_interval(one.within, 3),
            with_interval(one.coverage, 3),
            with_interval(one.radius, 3),
            with_interval(one.settled, 3),
        ]
        for one in figures.posteriors
    ]
    return table(headings, rows)
