from itertools import pairwise

import numpy as np
import pyarrow.parquet as pq
import pytest
from msgspec.structs import replace

from orchestrator.experiments.grid.observing import GridObserver, observe_parts
from orchestrator.experiments.grid.views import GLANCE_ANGLES, OBSERVED_CELLS, GridViews
from orchestrator.experiments.parts import Parts
from orchestrator.experiments.workers import Rate
from protocol.config import RunConfig
from protocol.errors import InvalidInput
from protocol.grid.table import CENTRE, cell_of
from protocol.messages import SampleScene
from tests.orchestrator.experiments.grid.grid_workers import JOINTS, GridWorkers, angle_of, sampled

VIEWS = GridViews(train=5, test=2)


def observed(workers, numbers=(0,), profile="vantage"):
    observer = GridObserver(VIEWS, RunConfig(profile=profile), workers, Rate(360 * len(numbers)))
    return list(observer.observe(numbers))


def test_an_environment_has_the_subjects_body_and_pose_in_a_scene_of_its_seed():
    for number, one in zip((3, 6), observed(GridWorkers(), (3, 6)), strict=True):
        place = one.place
        drawn = sampled(SampleScene(seed=place.seed, split=place.split)).scene
        assert (place.split, place.identity, place.pose) == (("train", 3, 3) if number == 3 else ("test", 41, 1))
        assert (drawn.pose, drawn.yaw) == (one.scene.pose, place.yaw)
        assert one.scene.identity == place.identity


def test_each_cell_has_what_was_estimated_from_it_relative_to_the_person():
    (one,) = observed(GridWorkers())
    cell, away = cell_of(-3, 4), 5.0
    assert one.quantities["mass"][cell] == pytest.approx(1 / 6)
    assert one.quantities["expected_error"][cell] == pytest.approx(0.01 * away)
    assert one.quantities["radius"][cell] == pytest.approx(0.02 * away)
    assert one.quantities["error"][cell] == pytest.approx(0.01 * away)
    assert one.truth == pytest.approx(JOINTS)
    assert one.points[cell] - JOINTS == pytest.approx(np.tile((0.0, 0.0, 0.01 * away), (18, 1)), abs=1e-6)


def test_the_centre_has_no_view():
    (one,) = observed(GridWorkers())
    assert not any(one.quantities[name][CENTRE].any() for name in ("mass", "height", "distance"))
    assert all(np.isnan(one.quantities[name][CENTRE]).all() for name in ("expected_error", "radius", "error"))
    assert np.isnan(one.points[CENTRE]).all()
    assert np.isfinite(np.delete(one.points, CENTRE, axis=0)).all()


def test_workers_that_tell_no_expected_error_leave_it_open():
    (one,) = observed(GridWorkers(calibrated=False), profile="thesis")
    assert np.isnan(one.quantities["expected_error"]).all()
    assert np.isnan(one.quantities["radius"]).all()
    assert one.quantities["error"][0] == pytest.approx(0.01 * 9 * 2**0.5)


def test_where_workers_track_every_view_has_the_filter_of_the_picture_from_the_front():
    workers = GridWorkers()
    observed(workers)
    first, *cells = workers.observed
    assert (angle_of(first), first.filter.seen.any(), first.filter.rule) == (0.0, False, "variance")
    assert len(cells) == 360
    assert all(one.filter.seen.all() for one in cells)
    assert len({one.filter.mean.tobytes() for one in cells}) == 1


def test_a_person_who_is_not_found_from_the_front_is_looked_for_from_the_sides():
    workers = GridWorkers(hides=GLANCE_ANGLES[:3])
    observed(workers, (0, 1))
    glances = [one for one in workers.observed if one.truth]
    assert [angle_of(one) for one in glances] == [0.0, 0.0, 30.0, 30.0, -30.0, -30.0, 60.0, 60.0]
    assert all(one.filter.seen.all() for one in workers.observed if not one.truth)


def test_a_person_who_is_never_found_leaves_the_filter_as_it_began():
    workers = GridWorkers(hides=tuple(range(-180, 181)))
    (one,) = observed(workers)
    assert not any(request.filter.seen.any() for request in workers.observed)
    assert np.isnan(one.points).all()
    assert one.truth == pytest.approx(JOINTS)


def test_without_tracking_the_filter_knows_nobody():
    workers = GridWorkers()
    observed(workers, profile="thesis")
    assert not any(one.filter.seen.any() for one in workers.observed)
    assert {one.filter.rule for one in workers.observed} == {"quality"}


def test_all_views_of_a_scene_are_asked_for_in_a_row():
    workers = GridWorkers()
    observed(workers, range(5))
    scenes = [one.scene.appearance for one in workers.observed if not one.truth]
    changes = sum(before != after for before, after in pairwise(scenes))
    assert (len(scenes), changes) == (5 * 360, 4)


def test_an_environment_does_not_depend_on_which_are_observed_with_it():
    alone, among = observed(GridWorkers(), (6,))[0], observed(GridWorkers(), (1, 2, 6))[2]
    assert alone.place == among.place
    assert all((alone.quantities[name] == among.quantities[name]).all() for name in ("mass", "height"))


def test_only_missing_environments_are_observed_and_the_rest_counts_as_done(tmp_path):
    parts = Parts(tmp_path / "views.parquet", VIEWS.count)
    whole = GridWorkers()
    observe_parts(parts, VIEWS, RunConfig(), whole)
    before = {path.name: path.read_bytes() for path in parts.folder.iterdir()}
    assert len(before) == 7
    for number in (2, 5):
        (parts.folder / f"part-{number:05d}.parquet").unlink()
    again = GridWorkers()
    observe_parts(parts, VIEWS, RunConfig(), again)
    assert len([one for one in again.observed if not one.truth]) == 2 * len(OBSERVED_CELLS)
    assert {path.name: path.read_bytes() for path in parts.folder.iterdir()} == before
    assert pq.read_table(parts.folder / "part-00005.parquet")["environment"].unique().to_pylist() == [5]


def test_a_pose_that_is_never_drawn_ends_the_search(monkeypatch):
    workers = GridWorkers()
    monkeypatch.setattr("orchestrator.experiments.grid.observing._MOST_DRAWS", 16)
    monkeypatch.setattr(
        "tests.orchestrator.experiments.grid.grid_workers.sampled",
        lambda request: sampled(SampleScene(seed=1, split="train")),
    )
    with pytest.raises(InvalidInput, match="none has pose 0"):
        observed(workers)


def test_workers_that_send_no_truth_are_refused(monkeypatch):
    estimate = GridWorkers.estimate

    def without_truth(self, request):
        return replace(estimate(self, request), joints=None)

    monkeypatch.setattr(GridWorkers, "estimate", without_truth)
    with pytest.raises(InvalidInput, match="without the truth"):
        observed(GridWorkers())
