"""An experiment's figures as a page for people, in Markdown."""

from collections.abc import Iterator, Sequence

from orchestrator.experiments.figures.flight_figures import FlightFigures
from orchestrator.experiments.figures.observation_figures import Coverage, JointError, QoeFigures, Score
from orchestrator.experiments.figures.sample import BANDS, LEARNED, WRONG_OF_LEARNED
from orchestrator.experiments.pages.flight_page import flight_sections
from orchestrator.experiments.pages.lifting_page import lifting_sections
from orchestrator.experiments.pages.markdown import number, table, title, with_interval
from orchestrator.experiments.targets.target import Target

_INTRODUCTION = """\
{frames} views of {people} people of the {split} split, seed {seed}: every identity in turn in every {pose}, 1.5 to 9 m
away, from all sides, 1 to 2.5 m high, evenly. Network {network}, each view {noises}.
Each figure has its 95% interval by bootstrap over people (1000 resamples).

- *Located*: a frame is the mean over its joints with a place in space; frames without any are left out.
- *All*: a frame is the mean over all 18 joints; one without a place has uncertainty 1 and the error of the centroid of
  the others.
- *Clipped*: no joint's error counts as more than 1 m. *Joint*: over single located joints. *AUROC*: of an error above
  0.15 m.
- *Quality* is taken as 1 − quality, with errors under the lifting that is named. A component alone goes with the
  thesis's mean.
"""
_CALIBRATED = """\
- *Expected error* and *radius* are the calibrated worker's, under its own lifting ({lifting}); in *all*, a missing
  joint counts as 1 m.
"""
_LEARNED = f"""\
- *Expected error* and *radius* are the learned lifter's, which locates all joints of whoever is found. For them,
  *located* are the joints that were seen, which is detected as well; in *all*, those that were inferred have their own
  estimate and uncertainty. Their AUROC is of an error above {WRONG_OF_LEARNED:.2f} m.
"""

PLOTS = {
    "scatter": "Each frame's uncertainty against its error, with the line that fits best",
    "reliability": "Joints in ten groups of rising uncertainty: their true error, and the coverage of the radius",
    "rho": "Correlation over frames by distance and azimuth",
    "joint-errors": "Mean error of each joint by each lifting",
    "flights": "The filter's posterior and the errors along flights",
}
"""What each plot shows."""


def page(
    figures: QoeFigures, targets: Sequence[Target], flights: FlightFigures | None = None, plots: str = "plots/"
) -> str:
    """All of it.

    Args:
        plots: what comes before a plot's name, to link to it.
    """
    return "\n".join(_sections(figures, targets, flights, plots))


def _sections(
    figures: QoeFigures, targets: Sequence[Target], flights: FlightFigures | None, plots: str
) -> Iterator[str]:
    def plot(name: str) -> str:
        return f"![{PLOTS[name]}]({plots}{name}.png)\n"

    noises = list(dict.fromkeys(one.noise for one in figures.scores))
    yield _introduction(figures, noises)
    yield _targets(targets)
    yield plot("scatter")
    yield plot("rho")
    yield plot("reliability")
    for noise in noises:
        own = [one for one in figures.scores if one.noise == noise]
        yield f"## {title(noise)}\n"
        yield _overall([one for one in own if one.band == "all"])
        yield "By distance:\n"
        yield _by_band(own)
    if figures.lifted:
        yield from lifting_sections(figures.lifted)
    if figures.coverage:
        yield "## The radius\n"
        yield _coverage(figures.coverage, noises)
    yield "## Error by joint and lifting\n"
    yield plot("joint-errors")
    for noise in noises:
        yield f"{title(noise)}. Metres; *far off*: share of errors above 0.3 m.\n"
        yield _lifting_totals([one for one in figures.errors if (one.noise, one.joint) == (noise, "all")])
        yield _joint_errors([one for one in figures.errors if one.noise == noise])
    if flights is not None:
        yield from flight_sections(flights)
        yield plot("flights")


def _introduction(figures: QoeFigures, noises: Sequence[str]) -> str:
    words = _INTRODUCTION.format(
        frames=figures.frames,
        people=figures.people,
        split=figures.split,
        pose="pose" if figures.poses == "kinds" else "family of poses that no training draws",
        seed=figures.seed,
        network=figures.network,
        noises=" and ".join(
            "with exact depth" if one == "none" else f"with noise as of a {one.upper()}" for one in noises
        ),
    )
    if figures.lifting == LEARNED:
        return words + _LEARNED
    return words + (_CALIBRATED.format(lifting=figures.lifting) if figures.coverage else "")


def _targets(targets: Sequence[Target]) -> str:
    rows = [
        [
            one.words,
            "exact" if one.noise == "none" else one.noise,
            _wanted(one),
            number(one.value, 3),
            "yes" if one.met else "**no**",
        ]
        for one in targets
    ]
    return table(["target", "depth", "wanted", "found", "met"], rows)


def _wanted(target: Target) -> str:
    if target.high >= 1:
        return f"≥ {target.low:.2f}"
    return f"≤ {target.high:.3f}" if target.low <= 0 else f"{target.low:.2f} to {target.high:.2f}"


def _overall(scores: Sequence[Score]) -> str:
    headings = [
        "uncertainty",
        "ρ located, raw",
        "ρ located, clipped",
        "ρ all, raw",
        "ρ all, clipped",
        "ρ joint, raw",
        "ρ joint, clipped",
        "Spearman, joint",
        "AUROC, joint",
    ]
    rows = [
        [
            one.uncertainty,
            *(
                with_interval(found)
                for found in (
                    one.located_raw,
                    one.located_clipped,
                    one.all_raw,
                    one.all_clipped,
                    one.joint_raw,
                    one.joint_clipped,
                    one.joint_spearman,
                    one.joint_auroc,
                )
            ),
        ]
        for one in scores
    ]
    return table(headings, rows) + f"\n{scores[0].frames} frames with {scores[0].joints} located joints.\n"


def _by_band(scores: Sequence[Score]) -> str:
    bands = [band for band in BANDS if band != "all"]
    headings = ["uncertainty", *(f"{words}, {band}" for words in _BY_BAND for band in bands)]
    by_name: dict[str, dict[str, Score]] = {}
    for one in scores:
        by_name.setdefault(one.uncertainty, {})[one.band] = one
    rows = [
        [
            name,
            *(
                with_interval(getattr(own[band], field)) if band in own else "–"
                for field in _BY_BAND.values()
                for band in bands
            ),
        ]
        for name, own in by_name.items()
    ]
    return table(headings, rows)


_BY_BAND = {"ρ located, raw": "located_raw", "ρ all, clipped": "all_clipped", "AUROC": "joint_auroc"}


def _coverage(coverages: Sequence[Coverage], noises: Sequence[str]) -> str:
    by_place: dict[str, dict[str, Coverage]] = {}
    for one in coverages:
        place = one.band if one.joint == "all" else one.joint
        by_place.setdefault(place, {})[one.noise] = one
    headings = [
        "",
        *(f"{words}, {title(noise).lower()}" for noise in noises for words in ("coverage", "mean radius, m")),
    ]
    rows = [
        [
            place,
            *(
                cell
                for noise in noises
                for cell in (
                    (with_interval(own[noise].coverage, 3), with_interval(own[noise].radius))
                    if noise in own
                    else ("–", "–")
                )
            ),
        ]
        for place, own in by_place.items()
    ]
    return table(headings, rows)


def _lifting_totals(errors: Sequence[JointError]) -> str:
    headings = ["lifting, all joints", "located", "mean", "median", "90% below", "far off"]
    rows = [
        [
            one.lifting,
            with_interval(one.located, 3),
            with_interval(one.mean, 3),
            with_interval(one.median, 3),
            with_interval(one.p90),
            with_interval(one.far_off, 3),
        ]
        for one in errors
    ]
    return table(headings, rows)


def _joint_errors(errors: Sequence[JointError]) -> str:
    by_joint: dict[str, dict[str, JointError]] = {}
    for one in errors:
        by_joint.setdefault(one.joint, {})[one.lifting] = one
    liftings = list(dict.fromkeys(one.lifting for one in errors))
    headings = ["joint", *(f"{words}, by {lifting}" for words in ("mean", "median", "far off") for lifting in liftings)]
    rows = [
        [
            joint,
            *(
                number(getattr(own[lifting], field).value)
                for field in ("mean", "median", "far_off")
                for lifting in liftings
            ),
        ]
        for joint, own in by_joint.items()
        if joint != "all"
    ]
    return table(headings, rows)
