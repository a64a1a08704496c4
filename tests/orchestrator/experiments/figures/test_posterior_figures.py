import numpy as np
import pytest
from msgspec.structs import replace

from orchestrator.experiments.figures.bootstrap import Figure
from orchestrator.experiments.figures.posterior_figures import Posterior, posterior, radius_of
from orchestrator.experiments.figures.sample import Sample
from orchestrator.experiments.targets.posterior_targets import posterior_targets


def flown(error: np.ndarray, variance: float, steps: int = 20) -> Sample:
    """One flight whose filter is off by `error` (steps, 18, 3) about the origin."""
    columns = {name: np.zeros((steps, 18)) for name in ("true_x", "true_y", "true_z")}
    columns |= {f"filter_{axis}": error[:, :, index] for index, axis in enumerate("xyz")}
    columns |= {f"posterior_{axis}": np.full((steps, 18), variance) for axis in "xyz"}
    columns["filter_error"] = np.linalg.norm(error, axis=2)
    columns["seen"] = np.ones((steps, 18))
    columns |= {"step": np.arange(steps, dtype=float), "identity": np.arange(steps) % 4.0, "frame": np.arange(steps)}
    return Sample(columns, poses=np.full(steps, "kinds"), lifting="learned")


def test_a_normal_error_is_within_its_deviation_and_its_radius_as_often_as_it_should_be():
    error = np.random.default_rng(0).normal(0.0, 0.05, (400, 18, 3))
    found = posterior("none", "circle", flown(error, 0.05**2, steps=400))
    assert found.within.value == pytest.approx(0.683, abs=0.01)
    assert found.coverage.value == pytest.approx(0.90, abs=0.01)
    assert found.radius.value == pytest.approx(2.5003 * 0.05, abs=1e-5)


def test_known_errors():
    # Along x alone: one of three axes is beyond its deviation, and 0.3 m are beyond the radius of 0.25 m.
    error = np.zeros((20, 18, 3))
    error[:, :, 0] = 0.3
    error[10:, :, 0] = 0.2
    found = posterior("none", "circle", flown(error, 0.1**2))
    assert found.within.value == pytest.approx(2 / 3)
    assert found.coverage.value == pytest.approx(0.5)
    assert found.settled.value == pytest.approx(0.2)


def test_the_radius_of_one_long_axis_is_a_normal_s():
    # 1.645 deviations hold 0.9 of a normal distribution.
    assert radius_of(np.array([0.04, 0.0, 0.0])) == pytest.approx(1.6449 * 0.2, abs=1e-4)
    draws = np.random.default_rng(1).normal(size=(200_000, 3)) * np.sqrt([0.04, 0.01, 0.0025])
    radius = radius_of(np.array([0.04, 0.01, 0.0025]))
    assert (np.linalg.norm(draws, axis=1) <= radius).mean() == pytest.approx(0.9, abs=0.01)


def test_targets_are_of_circles_with_exact_depth():
    good = Figure(value=0.03, low=0.0, high=1.0)
    one = Posterior(
        noise="none",
        path="circle",
        within=replace(good, value=0.7),
        coverage=replace(good, value=0.96),
        radius=good,
        settled=good,
    )
    wanted = list(posterior_targets([one, replace(one, noise="d435i"), replace(one, path="front")]))
    assert [target.met for target in wanted] == [True, True, False]
    assert list(posterior_targets([])) == []
