import re

import msgspec
import pyarrow.parquet as pq
import pytest
from msgspec.structs import replace
from PIL import Image

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.pages.markdown import table, with_interval
from orchestrator.experiments.pages.page import page
from orchestrator.experiments.results import Results, publish, work_out
from orchestrator.experiments.targets.observation_targets import targets
from orchestrator.experiments.targets.target import Target
from orchestrator.experiments.views import ViewSet
from protocol.config import RunConfig
from protocol.errors import InvalidInput

pytestmark = pytest.mark.slow


TABLES = {
    "calibrated": {},
    "not calibrated": {"calibrated": False},
    "learned": {"lifting": "learned"},
    "learned, families": {"lifting": "learned", "families": ("squat", "sit")},
}


@pytest.fixture(scope="module", params=TABLES.values(), ids=TABLES)
def directory(request, tmp_path_factory, made_up_table) -> ExperimentDirectory:
    views = ViewSet(frames=60, poses="families" if "families" in request.param else "kinds")
    directory = ExperimentDirectory.open_for(tmp_path_factory.mktemp("e"), RunConfig(), views)
    pq.write_table(made_up_table(**request.param), directory.table_path)
    return directory


@pytest.fixture(scope="module")
def results(directory) -> Results:
    return work_out(directory)


def test_figures_page_and_plots_are_made_of_the_table(directory, results):
    assert msgspec.json.decode(directory.figures_path.read_bytes())["qoe"]["frames"] == 60
    assert (results.qoe.people, results.qoe.network) == (4, "net")
    assert results.qoe.lifting == ("learned" if results.qoe.lifted else "nearest")
    plots = {path.name: Image.open(path) for path in directory.plots.iterdir()}
    assert set(plots) == {"scatter.png", "reliability.png", "rho.png", "joint-errors.png"}
    for path in directory.plots.iterdir():
        assert path.stat().st_size < 100_000
    assert all(len(plot.convert("RGB").getcolors(10_000)) > 10 for plot in plots.values())


def test_a_page_has_every_uncertainty_and_says_when_one_is_not_there(directory, results):
    text = directory.page_path.read_text()
    for words in ("60 views of 4 people", "| quality, mean |", "## Exact depth", "Depth with stereo noise (d435i)"):
        assert words in text
    calibrated = bool(results.qoe.coverage)
    assert ("| expected error |" in text, "## The radius" in text) == (calibrated, calibrated)
    assert "nan" not in text


def test_a_page_has_what_a_learned_lifter_came_to_and_where_its_people_were(directory, results):
    text = directory.page_path.read_text()
    learned, families = bool(results.qoe.lifted), results.qoe.poses == "families"
    for words in ("## The learned lifter", "| under 3 m, seen |", "| learned |", "mean, by learned", "above 0.10 m"):
        assert (words in text) == learned
    assert ("| squat, inferred |" in text, "in every family" in text) == (families, families)
    assert ("| kind 7, seen |" in text) == (learned and not families)


def test_there_are_no_figures_without_a_whole_table(tmp_path):
    directory = ExperimentDirectory.open_for(tmp_path, RunConfig(), ViewSet(frames=60))
    with pytest.raises(InvalidInput, match="experiment qoe"):
        work_out(directory)


def test_a_published_page_finds_its_plots(directory, results, tmp_path):
    publish(directory, results, tmp_path / "docs" / "qoe.md")
    text = (tmp_path / "docs" / "qoe.md").read_text()
    linked = re.findall(r"\]\((images/[^)]+)\)", text)
    assert len(linked) == 4
    assert all((tmp_path / "docs" / name).is_file() for name in linked)
    assert text.startswith("# ")


def test_a_missed_target_is_said_to_be_missed(results):
    missed = replace(results.targets[0], value=0.599)
    assert not missed.met
    assert "| exact | ≥ 0.60 | 0.599 | **no** |" in page(results.qoe, [missed])
    off = Target(words="mean error, m", value=0.0651, low=0.0, high=0.065, noise="d435i")
    assert "| mean error, m | d435i | ≤ 0.065 | 0.065 | **no** |" in page(results.qoe, [off])
    assert Target(words="", value=0.6, low=0.6).met
    assert not Target(words="", value=0.93, low=0.88, high=0.92).met


def test_targets_of_the_calibration_are_set_where_there_is_one_and_not_for_a_learned_lifter(results):
    found = list(targets(results.qoe))
    calibrated = bool(results.qoe.coverage) and not results.qoe.lifted
    assert any(one.words == "expected error: ρ of frames, located joints, clipped" for one in found) == calibrated
    assert (len(found) == (8 if calibrated else 2)) == (not results.qoe.lifted)
    by_band = {(one.band, one.joint): one.coverage.value for one in results.qoe.coverage if one.noise == "none"}
    if calibrated:
        assert found[-1].value == min(value for (_, joint), value in by_band.items() if joint != "all")
        assert found[-2].value == min(value for (band, _), value in by_band.items() if band != "all")


def test_numbers_in_a_table():
    nan = float("nan")
    assert with_interval(Figure(0.637, 0.6, 0.671)) == "0.64 [0.60, 0.67]"
    assert with_interval(Figure(0.637, nan, nan)) == "0.64"
    assert with_interval(Figure(nan, nan, nan)) == "–"
    assert table(["a", "b"], [["x", "1"]]) == "| a | b |\n| --- | ---: |\n| x | 1 |\n"
