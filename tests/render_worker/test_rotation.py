import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from render_worker.rotation import cross, frame, rotation, rotation_vector, shortest_turn

vectors = arrays(float, 3, elements=st.floats(-3, 3)).filter(lambda v: np.linalg.norm(v) > 1e-2)


def test_a_quarter_turn_about_the_vertical_takes_the_front_to_the_left():
    np.testing.assert_allclose(rotation((0, 0, np.pi / 2)) @ (1, 0, 0), (0, 1, 0), atol=1e-12)


def test_no_turn_is_the_identity():
    np.testing.assert_array_equal(rotation((0, 0, 0)), np.eye(3))


@given(vectors)
def test_a_rotation_keeps_lengths_and_handedness(vector):
    turned = rotation(vector)
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(turned) > 0


@given(vectors.filter(lambda v: np.linalg.norm(v) < 3.1))
def test_the_rotation_vector_comes_back_from_its_rotation(vector):
    np.testing.assert_allclose(rotation_vector(rotation(vector)), vector, atol=1e-6)


@given(vectors, vectors)
def test_the_shortest_turn_takes_one_direction_to_the_other(start, end):
    turned = shortest_turn(start, end) @ start / np.linalg.norm(start)
    cosine = start @ end / np.linalg.norm(start) / np.linalg.norm(end)
    if cosine > -0.999:
        np.testing.assert_allclose(turned, end / np.linalg.norm(end), atol=1e-6)


@given(vectors, vectors)
def test_a_frame_is_a_rotation_that_starts_along_its_first_vector(along, across):
    if np.linalg.norm(np.cross(along, across)) < 1e-3:
        return
    axes = frame(along, across)
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(axes[:, 0], along / np.linalg.norm(along), atol=1e-9)
    assert axes[:, 1] @ across > 0


def test_a_cross_product_is_numpys_to_the_bit():
    rng = np.random.default_rng(0)
    for one, other in rng.standard_normal((200, 2, 3)):
        np.testing.assert_array_equal(cross(one, other), np.cross(one, other))
