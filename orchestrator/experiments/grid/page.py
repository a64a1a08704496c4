"""The figures of the exploration experiment as a page in Markdown."""

from collections.abc import Iterator, Sequence

from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.grid.results import GridFigures, ThresholdFigures, VariantFigures
from orchestrator.experiments.grid.variants import VARIANTS
from orchestrator.experiments.pages.markdown import number, table, with_interval
from protocol.grid.threshold import THESIS_THRESHOLD

_THESIS_ROWS = (
    ("thesis: binary reward", "0.817", "0.020", "35.5 ± 26.7"),
    ("thesis: binary reward, path length penalty", "0.865", "0.040", "10.6 ± 19.2"),
    ("thesis: reward by quality", "0.925", "0.003", "12.1 ± 17.7"),
)
"""The best model of each reward, chosen on test data. Source: thesis, section 4.6.1."""

PLOTS = {
    "curves": "Success of the training's episodes, mean over seeds; the threshold falls meanwhile",
    "maps": "Walks on test environments: bright where the person is seen with certainty, white frames succeed",
}
"""The caption of each plot."""


def page(figures: GridFigures, plots: str = "plots/") -> str:
    """The whole page.

    Args:
        plots: the prefix of links to plots.
    """
    return "\n".join(_sections(figures, plots))


def _sections(figures: GridFigures, plots: str) -> Iterator[str]:
    yield (
        f"{figures.trainings} trainings, {figures.steps / 1e6:.1f} million steps, {figures.hours:.1f} hours of "
        "training, each on one core.\nEvery start in every test environment is walked; moves are drawn by the policy.\n"
        "Figures are means over seeds, with Student's 95% interval, for shares within 0 and 1; a baseline has none.\n"
    )
    for threshold in figures.thresholds:
        yield from _threshold_section(threshold)
    for name, caption in PLOTS.items():
        yield f"![{caption}]({plots}{name}.png)\n"


def _threshold_section(one: ThresholdFigures) -> Iterator[str]:
    optimum = "none succeeds" if one.optimum is None else f"{one.optimum:.2f} steps"
    yield f"### Table `{one.table}`, uncertainty below {one.threshold:g}\n"
    yield (
        f"{one.environments} test environments; ceiling (share with a cell that succeeds) {one.ceiling:.3f}; shortest "
        f"path, mean over their starts: {optimum}.\n"
    )
    thesis = _THESIS_ROWS if one.table == "thesis" and one.threshold == THESIS_THRESHOLD else ()
    headings = ("policy", "seeds", "success", "of solvable", "crash", "length", "of successes", "× optimum")
    rows = [_row(policy) for policy in one.policies]
    rows += [(words, "1", success, "", crash, length, "", "") for words, success, crash, length in thesis]
    yield table(headings, rows)
    yield _failures(one.policies)


def _row(policy: VariantFigures) -> Sequence[str]:
    return (
        _words(policy.policy),
        str(policy.seeds),
        with_interval(policy.success, 3),
        with_interval(policy.success_of_solvable, 3),
        with_interval(policy.crash, 4),
        f"{_length(policy.length)} ± {number(policy.length_deviation, 1)}",
        _length(policy.success_length),
        with_interval(policy.ratio),
    )


def _failures(policies: Sequence[VariantFigures]) -> str:
    modes = list(policies[0].failures)
    rows = [(_words(one.policy), *(str(one.failures[mode]) for mode in modes)) for one in policies]
    return "How episodes failed, number of all seeds:\n\n" + table(("policy", *modes), rows)


def _length(figure: Figure) -> str:
    return with_interval(figure, 1)


def _words(policy: str) -> str:
    return f"**{VARIANTS[policy].words}**" if policy in VARIANTS else policy
