import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.lifter.evidence import SHARE, evidence_of
from perception_worker.lifter.lifter import Lifter
from perception_worker.lifter.stored import checksum_of
from protocol.camera import Camera
from protocol.errors import ArtifactDamaged
from protocol.skeleton import MIRRORED
from tests.perception_worker.lifter.bodies import CAMERA, FACTORS, carried, joints, lifter, moved, picture, stored

FOUR = [0, 1, 2, 5]


def lifted(camera: Camera = CAMERA, kept=slice(None), points=None):
    keypoints, height, evidence, _ = picture(camera, points)
    left = np.full_like(keypoints, np.nan)
    left[kept] = keypoints[kept]
    return lifter().lift(left, np.where(np.isfinite(left[:, 0]), height, 0.0), evidence, camera)


def test_places_every_joint_of_somebody_found_and_says_how_far_off_it_may_be():
    for kept in (slice(None), FOUR):
        found = lifted(kept=kept)
        for array in found:
            assert np.isfinite(array).all()
        assert (found.radius > 0).all()
        assert (found.variance > 0).all()


def test_of_fewer_joints_than_three_nobody_follows():
    found = lifted(kept=[0, 1])
    for array in found:
        assert np.isnan(array).all()


def test_it_is_all_the_same_where_in_the_world_the_camera_stands():
    shift, turn = np.array([12.0, -7.0, 0.0]), 2.1
    here = lifted()
    there = lifted(moved(CAMERA, shift, turn), points=carried(joints(), shift, turn))
    np.testing.assert_allclose(there.points, carried(here.points, shift, turn), atol=1e-3)
    np.testing.assert_allclose(there.radius, here.radius, atol=1e-3)


def test_a_mirrored_person_is_lifted_to_the_mirrored_joints():
    # The camera is on the x axis and looks along it, so the world's y changes its sign.
    straight = lifted()
    turned = lifted(points=(joints() * (1.0, -1.0, 1.0))[MIRRORED])
    wanted = (straight.points * (1.0, -1.0, 1.0))[MIRRORED]
    np.testing.assert_allclose(turned.points, wanted, atol=1e-3)
    np.testing.assert_allclose(turned.radius, straight.radius[MIRRORED], rtol=1e-3)


def test_variances_are_along_the_world_s_axes():
    found = lifted()
    scale = np.sqrt(found.variance.sum(axis=1))
    np.testing.assert_allclose(found.radius, scale * FACTORS, rtol=1e-9)


def test_without_any_depth_it_is_less_sure():
    keypoints, height, _, depth = picture()
    nothing = evidence_of(np.full_like(depth, np.nan), keypoints, CAMERA.intrinsics.fx)
    assert not nothing.narrow[:, SHARE].any()
    unsure = lifter().lift(keypoints, height, nothing, CAMERA)
    scale = np.sqrt(unsure.variance.sum(axis=1))
    np.testing.assert_allclose(unsure.radius, 3.0 * scale * FACTORS, rtol=1e-9)
    assert np.isfinite(unsure.points).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"format": 99},
        {"tokens": 3},
        {"checksum": "0" * 64},
        {"weights": {}},
        {"unmeasured": 0.5},
        {"unmeasured": float("nan")},
    ],
)
def test_a_damaged_file_is_refused(wrong):
    with pytest.raises(ArtifactDamaged):
        Lifter(replace(stored(), **wrong))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_weights_that_are_not_finite_are_refused(value):
    """Whole by their checksum: a network that was fitted to nothing had placed everybody nowhere, without a word."""
    weights = dict(stored().weights)
    first = next(iter(weights))
    weights[first] = np.float16(value).tobytes() + weights[first][2:]
    with pytest.raises(ArtifactDamaged, match="not finite"):
        Lifter(replace(stored(), weights=weights, checksum=checksum_of(weights)))


def test_factors_that_are_none_are_refused():
    certainty = replace(stored().seen, radius=(float("nan"),) * 18)
    with pytest.raises(ArtifactDamaged, match="radius"):
        Lifter(replace(stored(), seen=certainty))
