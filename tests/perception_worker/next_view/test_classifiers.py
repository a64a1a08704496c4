import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.next_view.arrays import AROUND, CENTRE
from perception_worker.next_view.classifiers import LEFT, joints_and_quality, thesis_classifiers
from tests.perception_worker.next_view.scenes import arrays_of


def test_a_joint_is_given_in_the_camera_s_frame_beside_its_quality():
    arrays = arrays_of(1)
    # From (4, 0, 1) to (0, 0, 1): a joint a metre north of the person is on the camera's right, one above it is up.
    arrays.position[0, CENTRE], arrays.target[0, CENTRE] = (4.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    arrays.points[0, CENTRE] = np.nan
    arrays.points[0, CENTRE, :2] = (0.0, 1.0, 1.0), (1.0, 0.0, 1.5)
    arrays.quality[0, CENTRE, :3] = 0.7, 0.4, 0.0
    given = joints_and_quality(arrays, (CENTRE,))
    assert given.shape == (1, 72)
    assert given[0, :4] == pytest.approx([1.0, 0.0, 4.0, 0.7], abs=1e-6)
    assert given[0, 4:8] == pytest.approx([0.0, -0.5, 3.0, 0.4], abs=1e-6)
    assert (given[0, 8:12] == 0.0).all()


def test_several_views_are_given_one_after_another():
    arrays = arrays_of(3)
    both = joints_and_quality(arrays, (LEFT, CENTRE))
    assert (both[:, :72] == joints_and_quality(arrays, (LEFT,))).all()
    assert (both[:, 72:] == joints_and_quality(arrays, (CENTRE,))).all()


@pytest.mark.slow
def test_the_thesis_s_four_predictors_learn_their_train_scenes_and_only_these():
    arrays = arrays_of(24)
    others = replace(arrays, quality=np.where(arrays.is_train[:, None, None], arrays.quality, 0.5))
    pictures = np.random.default_rng(0).normal(size=(24, 512))
    ways = list(thesis_classifiers(arrays, pictures, (0,)))
    assert [way.method.rpartition(" [")[2] for way in ways] == [
        "584, 128, 16, 8]",
        "72, 64, 8]",
        "72, 32, 8]",
        "72, 32, 32, 8]",
    ]
    best = arrays.uncertainty[:, AROUND].argmin(axis=1)
    for way, unlabelled in zip(ways, thesis_classifiers(others, pictures, (0,)), strict=True):
        chosen = way.expected.argmin(axis=1)
        assert (chosen == best)[arrays.is_train].mean() > 0.9
        assert (unlabelled.expected[arrays.is_train] == way.expected[arrays.is_train]).all()
