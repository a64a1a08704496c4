import numpy as np
import pytest

from perception_worker.networks.models import OPENPOSE_MOBILENET_THIN, require_network
from perception_worker.next_view.picture_features import picture_features, principal_components
from protocol.errors import InvalidInput
from tests.perception_worker.next_view.scenes import arrays_of


def test_the_first_component_is_the_direction_in_which_train_scenes_differ_most():
    spread = np.random.default_rng(0).normal(size=(50, 1))
    features = spread * (3.0, 4.0, 0.0) + (1.0, 2.0, 7.0)
    components = principal_components(features, np.arange(50) < 40, 2)
    assert np.abs(components[:, 0]) == pytest.approx(np.abs(5.0 * (spread[:, 0] - spread[:40].mean())))
    assert components[:, 1] == pytest.approx(0.0, abs=1e-9)


def test_there_are_as_many_components_as_asked_for_however_few_the_scenes():
    components = principal_components(np.random.default_rng(0).normal(size=(6, 4)), np.arange(6) < 3, 512)
    assert components.shape == (6, 512)
    assert (components[:, 3:] == 0.0).all()
    assert np.isfinite(components).all()


@pytest.mark.slow
def test_a_picture_has_a_number_for_each_shared_channel():
    pictures = arrays_of(2).pictures
    first, second = picture_features(pictures, require_network(OPENPOSE_MOBILENET_THIN))
    assert first.shape == (864,)
    assert (first == second).all()
    with pytest.raises(InvalidInput, match="picture"):
        picture_features([b"no picture"], require_network(OPENPOSE_MOBILENET_THIN))
