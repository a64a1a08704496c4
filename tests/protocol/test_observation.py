import numpy as np
import pytest

from protocol.observation import FilterState


def test_a_new_filter_knows_nothing_and_expects_everybody_at_its_mean():
    state = FilterState.initial((1.0, 2.0, 3.0))
    assert (state.mean == (1.0, 2.0, 3.0)).all()
    assert (state.variance == 1.0).all()
    assert (state.process_noise == 0.01).all()
    assert not state.seen.any()


def test_a_filter_of_another_skeleton_is_refused():
    with pytest.raises(ValueError, match=r"mean has shape \(17, 3\)"):
        FilterState(
            mean=np.zeros((17, 3)), variance=np.ones((18, 3)), process_noise=np.ones(18), seen=np.zeros(18, bool)
        )
