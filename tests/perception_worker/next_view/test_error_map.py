import numpy as np
import pytest

from perception_worker.next_view.arrays import AROUND, CAMERAS, CENTRE
from perception_worker.next_view.baselines import DIRECTIONS, baselines, towards_front
from perception_worker.next_view.classifiers import LEFT
from perception_worker.next_view.error_map import MAPS, Map, MapChooser, viewpoint
from tests.perception_worker.next_view.scenes import arrays_of


def test_a_viewpoint_is_told_by_distance_height_and_angle():
    told = viewpoint(np.array([0.0, 2.0, 1.5]))
    # At a person's left: the angle is 90 degrees, and twice that 180.
    assert told == pytest.approx([2.0, 0.5, 1.5, 0.0, 1.0, -1.0, 0.0], abs=1e-9)


@pytest.mark.slow
def test_a_map_leads_people_that_it_was_not_fitted_on_towards_the_front():
    arrays = arrays_of(160)
    joints = np.repeat(arrays.joints[:, None], CAMERAS, axis=1)
    expected = MapChooser(arrays, joints, Map(method="pose and viewpoint", told=False)).expected(0)
    around = arrays.uncertainty[:, AROUND]
    test = ~arrays.is_train
    chosen = np.take_along_axis(around, expected.argmin(axis=1)[:, None], axis=1)[:, 0]
    assert (chosen - around.min(axis=1))[test].mean() < 0.1 * (around.mean(axis=1) - around.min(axis=1))[test].mean()


@pytest.mark.slow
def test_a_camera_that_was_seen_has_its_own_uncertainty_and_not_a_prediction():
    arrays = arrays_of(24)
    joints = np.repeat(arrays.joints[:, None], CAMERAS, axis=1)
    two_views = next(one for one in MAPS if one.seen == (CENTRE, LEFT))
    expected = MapChooser(arrays, joints, two_views).expected(0)
    assert (expected[:, AROUND == LEFT] == arrays.uncertainty[:, [LEFT]]).all()
    assert (expected[:, AROUND != LEFT] != arrays.uncertainty[:, AROUND[AROUND != LEFT]]).all()


def test_the_front_is_on_the_side_that_a_person_turns_to():
    arrays = arrays_of(40)
    bearing = np.arctan2(arrays.position[:, CENTRE, 1], arrays.position[:, CENTRE, 0])
    # The camera's right is the next bearing counter-clockwise.
    right = towards_front(arrays, bearing + 0.5).argmin(axis=1)
    left = towards_front(arrays, bearing - 2.5).argmin(axis=1)
    assert {DIRECTIONS[one] for one in right} == {"right"}
    assert {DIRECTIONS[one] for one in left} == {"left"}


def test_baselines_learn_from_train_scenes_alone():
    arrays = arrays_of(12, lambda distance, angle, height: 10.0 - height + 0.0 * angle)
    arrays.quality[~arrays.is_train] = arrays.quality[~arrays.is_train][:, ::-1]
    joints = np.repeat(arrays.joints[:, None], CAMERAS, axis=1)
    by_name = {one.method: one.expected for one in baselines(arrays, joints, (0, 1))}
    assert set(by_name["the lowest on average in training"].argmin(axis=1)) <= {0, 1, 2}
    visited = by_name["the better of left and right, both visited"].argmin(axis=1)
    assert {DIRECTIONS[one] for one in visited} <= {"left", "right"}
    assert by_name["towards the front, as estimated"] == pytest.approx(by_name["towards the front, as it is"])
