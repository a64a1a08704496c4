"""Lengths of normally distributed vectors, against exact values and against draws."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.environment.v1.posterior import expected_errors, over_upper_body, radii
from protocol.skeleton import Joint


def test_of_a_ball_lengths_are_those_of_a_maxwell_distribution() -> None:
    variance = np.array([0.04, 0.04, 0.04])
    assert expected_errors(variance) == pytest.approx(0.2 * math.sqrt(8 / math.pi), rel=0.002)
    assert radii(variance) == pytest.approx(0.2 * 2.5003, rel=0.004)


def test_along_one_axis_lengths_are_those_of_a_half_normal_distribution() -> None:
    variance = np.array([0.0, 0.09, 0.0])
    assert expected_errors(variance) == pytest.approx(0.3 * math.sqrt(2 / math.pi), rel=0.01)
    assert radii(variance) == pytest.approx(0.3 * 1.6449, rel=0.015)


@pytest.mark.parametrize("variance", [(1.0, 0.5, 0.1), (0.01, 0.01, 0.0004), (4e-4, 1e-4, 1e-4)])
def test_lengths_are_those_of_draws(variance: tuple[float, float, float]) -> None:
    drawn = np.random.default_rng(0).normal(size=(200_000, 3)) * np.sqrt(variance)
    lengths = np.linalg.norm(drawn, axis=1)
    assert expected_errors(np.array(variance)) == pytest.approx(lengths.mean(), rel=0.02)
    assert radii(np.array(variance)) == pytest.approx(np.quantile(lengths, 0.9), rel=0.03)


@given(st.lists(st.floats(0.0, 10.0), min_size=3, max_size=3), st.floats(0.01, 100.0))
def test_lengths_grow_with_the_deviations(variance: list[float], factor: float) -> None:
    one = np.array(variance) + 1e-6
    for length in (expected_errors, radii):
        assert length(factor**2 * one) == pytest.approx(factor * length(one), rel=1e-6)


def test_no_variance_is_no_error() -> None:
    assert expected_errors(np.zeros((18, 3))).max() < 1e-5
    assert radii(np.zeros((18, 3))).max() < 1e-5


def test_the_upper_bodys_mean_is_by_the_thesiss_weights() -> None:
    lengths = np.zeros(18)
    lengths[[Joint.NOSE, Joint.LEFT_WRIST, Joint.LEFT_KNEE]] = 0.1, 0.2, 5.0
    assert over_upper_body(lengths) == pytest.approx((2.0 * 0.1 + 0.5 * 0.2) / 10)
    assert over_upper_body(np.full(18, 0.3)) == pytest.approx(0.3)
