import numpy as np
import pytest

from render_worker.noise import seamless_noise, shifted


@pytest.mark.parametrize("roughness", [0.2, 1.0, 2.0])
def test_noise_is_centred_and_scaled(roughness):
    noise = seamless_noise(128, roughness, 1.0, 3)
    assert noise.mean() == pytest.approx(0, abs=1e-4)
    assert noise.std() == pytest.approx(1, abs=1e-3)


def test_noise_has_no_seam():
    noise = seamless_noise(256, 2.0, 1.0, 3)
    inside = np.abs(np.diff(noise, axis=0)).mean()
    across = np.abs(noise[0] - noise[-1]).mean()
    assert across < 2 * inside


def test_stretched_noise_runs_along_the_columns():
    noise = seamless_noise(256, 1.5, 0.2, 3)
    down, across = np.abs(np.diff(noise, axis=0)).mean(), np.abs(np.diff(noise, axis=1)).mean()
    assert down != pytest.approx(across, rel=0.3)


def test_shifting_keeps_the_values():
    noise = seamless_noise(64, 1.0, 1.0, 5)
    moved = shifted(noise, np.random.default_rng(1))
    np.testing.assert_array_equal(np.sort(moved.ravel()), np.sort(noise.ravel()))
    assert (moved != noise).any()
