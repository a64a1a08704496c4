import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from perception_worker.median import median

METRES = st.floats(-100.0, 100.0)


def test_of_an_even_number_it_is_the_mean_of_the_middle_two():
    assert median(np.array([9.0, 1.0, 4.0, 2.0])) == 3.0
    assert median(np.array([[5.0, 1.0], [3.0, 7.0], [4.0, 2.0]])).tolist() == [4.0, 2.0]


@given(arrays(float, st.tuples(st.integers(1, 18), st.just(3)), elements=METRES))
def test_it_is_numpy_s_to_the_bit(values: np.ndarray):
    assert np.array_equal(median(values), np.median(values, axis=0))


def test_of_nothing_there_is_none():
    with pytest.raises(IndexError):
        median(np.empty((0, 3)))
