"""The scores of the next view as Markdown."""

from collections.abc import Iterator

from orchestrator.experiments.next_view.scores import NEAR, NextViewScores, WayScores
from orchestrator.experiments.pages.markdown import number, table, with_interval

GROUPS = {
    "thesis": "The thesis's predictors",
    "memory": "The same with a memory",
    "map": "A map of the expected uncertainty around the person",
    "bound": "The same map, told the true pose",
    "baseline": "Baselines",
}
"""Groups of ways, in the order of the page."""

THESIS_ERRORS = {
    "[584, 128, 16, 8]": (0.13, 0.82),
    "[72, 64, 8]": (0.07, 0.86),
    "[72, 32, 8]": (0.10, 0.76),
    "[72, 32, 32, 8]": (0.18, 0.88),
}
"""Train and test error by layers. Source: thesis, section 4.2."""

_INTRODUCTION = """\
{train} train and {test} test scenes of {people} people that no training used, nine cameras each, {spacing:g} m apart.
{undecided} more, in which no camera around the centre finds the person, are left out.
The mean weighted uncertainty of the upper body (0 to 10) is {centre} at the centre.
At the best camera around it, it is {best}, at the median {lead} below the second best.
The camera that is best most often is so in {most:.0%} of the test scenes. A random choice errs in {chance:.1%}.

- *Train*, *test*: top-1 error, the share of scenes in which another of the eight cameras is better than the chosen one.
  *Within {near:g}*: the same where the chosen camera's uncertainty may be {near:g} above the best.
- *Share*: the improvement over the centre that the choices get, divided by what the best cameras would get.
- Means over seeds, with 95% intervals by bootstrap over people. In parentheses the thesis's errors.
"""


def page(scores: NextViewScores) -> str:
    """The whole page."""
    return "\n".join([_introduction(scores), table(_HEADINGS, list(_rows(scores)))])


_HEADINGS = ("way of choosing", "seeds", "train", "test", f"within {NEAR:g}", "share", "uncertainty")


def _introduction(scores: NextViewScores) -> str:
    return _INTRODUCTION.format(
        train=scores.train,
        test=scores.test,
        people=scores.people,
        spacing=scores.spacing,
        undecided=scores.undecided,
        centre=with_interval(scores.centre),
        best=with_interval(scores.best),
        lead=with_interval(scores.lead),
        most=max(scores.best_by_camera),
        chance=scores.chance,
        near=NEAR,
    )


def _rows(scores: NextViewScores) -> Iterator[tuple[str, ...]]:
    for group, words in GROUPS.items():
        own = [one for one in scores.ways if one.group == group]
        if own:
            yield (f"**{words}**", *[""] * (len(_HEADINGS) - 1))
            yield from map(_row, own)


def _row(one: WayScores) -> tuple[str, ...]:
    thesis = next((errors for layers, errors in THESIS_ERRORS.items() if one.method.endswith(layers)), None)
    train, test = ("", "") if thesis is None else (f" ({error:.2f})" for error in thesis)
    return (
        one.method,
        str(one.seeds),
        number(one.train_error) + train,
        with_interval(one.error) + test,
        with_interval(one.near_error),
        with_interval(one.share),
        with_interval(one.uncertainty),
    )
