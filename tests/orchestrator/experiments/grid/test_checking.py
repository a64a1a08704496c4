import msgspec
import pytest
from msgspec.structs import replace

from orchestrator.experiments.grid.checking import (
    RebuiltEnvironment,
    TableCheck,
    compared,
    differences,
    require_alike,
    settings_of,
    spread_over,
)
from orchestrator.experiments.grid.observing import GridObserver
from orchestrator.experiments.grid.views import GridViews
from orchestrator.experiments.views_directory import what_counts
from orchestrator.experiments.workers import Rate
from orchestrator.run.config_toml import plain_toml
from protocol.config import PerceptionConfig, RunConfig
from protocol.errors import InvalidInput
from protocol.grid.table import SHARES, GridRecipe, StoredGridTable, stored_place
from tests.orchestrator.experiments.grid.grid_workers import GridWorkers

VIEWS = GridViews(train=2, test=1)


def rebuilt(numbers=(0, 1, 2), **workers):
    return list(GridObserver(VIEWS, RunConfig(), GridWorkers(**workers), Rate(360 * 3)).observe(numbers))


@pytest.fixture(scope="module")
def shipped() -> StoredGridTable:
    recipe = GridRecipe(
        certainty="quality",
        version="0.1.0",
        config=plain_toml(what_counts(RunConfig(profile="thesis"))).decode(),
        views=msgspec.json.encode(VIEWS).decode(),
        perception={"lifting": "mean", "look": "whole"},
    )
    places = [stored_place(one.place, one.truth, {name: one.quantities[name] for name in SHARES}) for one in rebuilt()]
    return StoredGridTable(recipe=recipe, quantities=tuple(sorted(SHARES)), places=tuple(places), checksum="")


def test_environments_built_again_have_the_same_bytes(shipped):
    assert [(one.number, one.same) for one in compared(shipped, (0, 2), rebuilt((0, 2)))] == [(0, True), (2, True)]


def test_a_number_that_differs_is_counted(shipped):
    (again,) = rebuilt((1,))
    again.quantities["mass"][17, 3] += 0.5
    (found,) = compared(shipped, (1,), [again])
    assert (found.same, found.differing) == (False, 1)
    assert found.words == "environment 1 (train, identity 1, pose 1): 1 numbers differ"


@pytest.mark.parametrize("change", [{"yaw": 0.0}, {"seed": 1}])
def test_another_scene_is_not_the_same_whatever_its_numbers_are(shipped, change):
    (again,) = rebuilt((1,))
    (found,) = compared(shipped, (1,), [replace(again, place=replace(again.place, **change))])
    assert (found.same, found.differing, found.words.endswith("another scene")) == (False, 0, True)


def test_a_joint_that_is_elsewhere_is_not_the_same(shipped):
    (again,) = rebuilt((1,))
    again.truth[0, 0] += 0.001
    assert not next(compared(shipped, (1,), [again])).same


def test_a_recipe_says_the_configuration_and_the_views(shipped, tmp_path):
    config, views = settings_of(shipped, tmp_path)
    assert what_counts(config) == what_counts(RunConfig(profile="thesis"))
    assert config.perception.prefetch == PerceptionConfig().prefetch
    assert views == VIEWS


def with_recipe(shipped, **changes) -> StoredGridTable:
    return replace(shipped, recipe=replace(shipped.recipe, **changes))


def test_a_recipe_of_another_table_is_refused(shipped, tmp_path):
    other = with_recipe(shipped, views=msgspec.json.encode(GridViews()).decode())
    with pytest.raises(InvalidInput, match="3 environments, and another recipe: 80 train and 40 test"):
        settings_of(other, tmp_path)
    with pytest.raises(InvalidInput, match="can't read"):
        settings_of(with_recipe(shipped, views='{"train": "many"}'), tmp_path)


def test_a_recipe_with_a_file_of_its_own_is_refused_by_the_files_name(shipped, tmp_path):
    own = RunConfig(perception=PerceptionConfig(network="sha256:" + 64 * "0"))
    with pytest.raises(InvalidInput, match="built with the network sha256:0"):
        settings_of(with_recipe(shipped, config=plain_toml(own).decode()), tmp_path)


def test_workers_that_see_otherwise_are_refused_by_what_differs(shipped):
    require_alike(shipped.recipe, {"lifting": "mean", "look": "whole"})
    with pytest.raises(InvalidInput, match=r"lifting \(mean, now median\), mask \(None, now none\)"):
        require_alike(shipped.recipe, {"lifting": "median", "look": "whole", "mask": "none"})


def test_libraries_of_other_versions_are_named_where_numbers_differ():
    place = rebuilt((0,))[0].place
    differing = RebuiltEnvironment(number=0, place=place, same=False, differing=3)
    packages = differences({"numpy": "2.0", "openvino": "2026.0"}, {"numpy": "2.0", "openvino": "2026.1"})
    assert packages == ("openvino (2026.0, now 2026.1)",)
    check = TableCheck(table="t", environments=(differing,), packages=packages)
    assert (check.same, "openvino (2026.0, now 2026.1)" in check.words) == (False, True)
    assert "openvino" not in replace(check, environments=(replace(differing, same=True),)).words


@pytest.mark.parametrize(("count", "wanted", "numbers"), [(120, 2, (0, 119)), (120, 3, (0, 60, 119)), (2, 9, (0, 1))])
def test_environments_to_build_again_are_spread_over_the_table(count, wanted, numbers):
    assert spread_over(count, wanted) == numbers
