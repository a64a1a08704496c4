"""From an experiment's tables to figures, a page and plots on disk."""

from pathlib import Path

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq
from msgspec import Struct

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.figures.bootstrap import people_of
from orchestrator.experiments.figures.flight_figures import FlightFigures, flight_figures
from orchestrator.experiments.figures.lifting_figures import lifted_joints
from orchestrator.experiments.figures.observation_figures import QoeFigures, coverages, errors, scores
from orchestrator.experiments.figures.sample import Sample, samples_of
from orchestrator.experiments.pages.flight_plot import flights_plot
from orchestrator.experiments.pages.page import page
from orchestrator.experiments.pages.plots import write, write_plots
from orchestrator.experiments.targets.observation_targets import targets
from orchestrator.experiments.targets.posterior_targets import posterior_targets
from orchestrator.experiments.targets.target import Target
from protocol.artifact import whole_file
from protocol.errors import InvalidInput

TITLE = "How far a pose and its quality can be trusted"


class Results(Struct, frozen=True, kw_only=True):
    """All figures of an experiment."""

    qoe: QoeFigures
    targets: tuple[Target, ...]
    flights: FlightFigures | None = None


def work_out(directory: ExperimentDirectory) -> Results:
    """Compute all figures from the tables, and write them, their page and their plots.

    Raises:
        InvalidInput: the table of views is not complete yet.
    """
    if not directory.table_path.is_file():
        raise InvalidInput(f"{directory.table_path} does not exist yet; make it with 'orchestrator experiment qoe'")
    table = pq.read_table(directory.table_path)
    samples = samples_of(table)
    qoe = _qoe_figures(directory, table, samples)
    flown = pq.read_table(directory.flights_path) if directory.flights_path.is_file() else None
    flights = flight_figures(flown) if flown is not None else None
    wanted = (*targets(qoe), *(posterior_targets(flights.posteriors) if flights else ()))
    results = Results(qoe=qoe, targets=wanted, flights=flights)
    with whole_file(directory.figures_path) as aside:
        aside.write_bytes(msgspec.json.format(msgspec.json.encode(results), indent=2) + b"\n")
    with whole_file(directory.page_path) as aside:
        aside.write_text(page(qoe, results.targets, flights), encoding="utf-8")
    write_plots(directory.plots, samples, qoe)
    if flown is not None:
        write(directory.plots / "flights.png", flights_plot(flown))
    return results


def publish(directory: ExperimentDirectory, results: Results, path: Path) -> None:
    """Also write the page to `path`, and its plots to `images/` beside it, with the page's name as prefix."""
    images = path.parent / "images"
    for plot in sorted(directory.plots.glob("*.png")):
        with whole_file(images / f"{path.stem}-{plot.name}") as aside:
            aside.write_bytes(plot.read_bytes())
    text = page(results.qoe, results.targets, results.flights, plots=f"images/{path.stem}-")
    with whole_file(path) as aside:
        aside.write_text(f"# {TITLE}\n{text}", encoding="utf-8")


def _qoe_figures(directory: ExperimentDirectory, table: pa.Table, samples: dict[str, Sample]) -> QoeFigures:
    views, first = directory.views(), next(iter(samples.values()))
    return QoeFigures(
        frames=len(first),
        people=int(people_of(first["identity"]).max()) + 1,
        split=views.split,
        poses=views.poses,
        seed=views.seed,
        network=_names(table, "network"),
        lifting=_names(table, "lifting"),
        scores=tuple(scores(samples)),
        coverage=tuple(coverages(samples)),
        errors=tuple(errors(samples)),
        lifted=tuple(lifted_joints(samples)),
    )


def _names(table: pa.Table, column: str) -> str:
    return ", ".join(sorted({str(name) for name in table[column].unique().to_pylist()}))
