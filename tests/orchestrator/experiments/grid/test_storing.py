import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from orchestrator.experiments.grid.directory import GridDirectory, default_path
from orchestrator.experiments.grid.observing import observe_parts
from orchestrator.experiments.grid.storing import store
from orchestrator.experiments.grid.summary import summary_of
from orchestrator.experiments.grid.views import GridViews
from orchestrator.experiments.qoe import provenance
from protocol.config import RunConfig
from protocol.errors import ArtifactDamaged, DamagedRecord, InvalidInput
from protocol.grid.table import cell_of, read_stored_table, read_table
from protocol.grid.threshold import weighted_uncertainties
from tests.orchestrator.experiments.grid.grid_workers import JOINTS, GridWorkers

VIEWS = GridViews(train=2, test=1)


def built(path, versions, profile="vantage", *, calibrated=True, change=lambda views: views) -> GridDirectory:
    """A directory with all views, perhaps changed, and no table yet."""
    config = RunConfig(profile=profile)
    directory = GridDirectory.open_for(path, config, VIEWS)
    observe_parts(directory.parts(), VIEWS, config, GridWorkers(calibrated=calibrated))
    directory.parts().join(provenance(config, VIEWS, versions, {"lifting": "learned"}))
    whole = pq.read_table(directory.all_views_path)
    changed = change(whole)
    if changed is not whole:
        with pq.ParquetWriter(directory.all_views_path, whole.schema) as writer:
            for number in range(VIEWS.count):
                writer.write_table(changed.filter(pa.compute.equal(changed["environment"], number)))
    return directory


def test_a_table_has_what_was_observed(tmp_path, versions):
    directory = built(tmp_path / "g", versions)
    store(directory)
    table = read_table(directory.table_path)
    assert [(one.split, one.identity, one.pose) for one in table.places] == [
        ("train", 0, 0),
        ("train", 1, 1),
        ("test", 40, 0),
    ]
    assert table.truth == pytest.approx(np.tile(JOINTS, (3, 1, 1)), abs=1e-6)
    assert table.quantities["error"][:, cell_of(0, 5)] == pytest.approx(0.05, rel=0.02)
    assert table.quantities["mass"][:, cell_of(3, 0)] == pytest.approx(0.25, abs=0.002)
    assert table.recipe.certainty == "metres"
    assert msgspec.json.decode(table.recipe.views, type=GridViews) == VIEWS
    assert 'profile = "vantage"' in table.recipe.config
    assert table.recipe.packages == {"numpy": "2.0"}


def test_a_table_in_metres_is_as_uncertain_as_the_expected_errors(tmp_path, versions):
    directory = built(tmp_path / "g", versions)
    store(directory)
    weighted = weighted_uncertainties(read_table(directory.table_path))
    # An expected error of 5 cm in every joint, half of what counts as unknown.
    assert weighted[:, cell_of(0, 5)] == pytest.approx(5.0, rel=0.02)
    summary = summary_of(directory.table_path)
    # 1 cm, from a metre away: 1 and a little by the steps of storage, and the lowest threshold above it.
    assert summary.threshold == pytest.approx(1.05)
    assert [(one.environments, one.ceiling) for one in summary.splits] == [(2, 1.0), (1, 1.0)]


def test_a_table_of_quality_has_no_lengths_that_no_worker_told(tmp_path, versions):
    directory = built(tmp_path / "g", versions, "thesis", calibrated=False)
    store(directory)
    assert read_stored_table(directory.table_path).quantities == ("distance", "error", "height", "mass")
    assert read_table(directory.table_path).recipe.certainty == "quality"


def test_a_table_in_metres_of_workers_that_tell_none_is_refused(tmp_path, versions):
    directory = built(tmp_path / "g", versions, calibrated=False)
    with pytest.raises(InvalidInput, match="no expected errors"):
        store(directory)
    assert not directory.table_path.exists()


def test_the_same_views_give_the_same_bytes_and_a_table_is_made_once(tmp_path, versions):
    first, second = built(tmp_path / "a", versions), built(tmp_path / "b", versions)
    for directory in (first, second, first):
        store(directory)
    assert first.table_path.read_bytes() == second.table_path.read_bytes()


def test_an_environment_with_a_missing_view_is_refused_by_its_name_and_the_cell(tmp_path, versions):
    missing = 361 + cell_of(-2, 7)
    directory = built(
        tmp_path / "g",
        versions,
        change=lambda views: pa.concat_tables([views.slice(0, missing), views.slice(missing + 1)]),
    )
    with pytest.raises(DamagedRecord, match=r"identity 1, pose 1, seed \d+ has no view from -2, 7"):
        store(directory)


def test_an_identity_in_both_splits_is_refused_by_its_number(tmp_path, versions):
    def with_another_split(views):
        split = [*["train"] * 361, *["test"] * 361, *["test"] * 361]
        identity = [*[0] * 361, *[0] * 361, *[40] * 361]
        for name, values in (("split", split), ("identity", identity)):
            index = views.schema.get_field_index(name)
            views = views.set_column(index, views.schema.field(name), pa.array(values, views.schema.field(name).type))
        return views

    directory = built(tmp_path / "g", versions, change=with_another_split)
    with pytest.raises(ArtifactDamaged, match="identity 0 is in both splits"):
        store(directory)


@pytest.mark.parametrize("other", [GridViews(train=3, test=1), GridViews(train=2, test=1, seed=1)])
def test_a_directory_of_another_recipe_is_refused(tmp_path, other):
    GridDirectory.open_for(tmp_path / "g", RunConfig(), VIEWS)
    with pytest.raises(InvalidInput, match=r"2 train and 1 test environments, seed 0.*not .*--out"):
        GridDirectory.open_for(tmp_path / "g", RunConfig(), other)
    with pytest.raises(InvalidInput, match="another configuration"):
        GridDirectory.open_for(tmp_path / "g", RunConfig(profile="thesis"), VIEWS)


def test_each_profile_has_a_directory_of_its_own():
    assert default_path("thesis") != default_path("vantage")
