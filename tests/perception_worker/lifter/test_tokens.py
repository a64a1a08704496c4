import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.lifter.evidence import LEAST, SHARE
from perception_worker.lifter.tokens import TOKEN_SIZE, Seen, mirrored, points_of, tokens_of
from protocol.camera import project
from protocol.skeleton import JOINT_COUNT, MIRRORED, Joint
from tests.perception_worker.lifter.bodies import CAMERA, INTRINSICS, joints, picture


def seen_of(keypoints, height, evidence) -> Seen:
    rays = (keypoints - (INTRINSICS.cx, INTRINSICS.cy)) / (INTRINSICS.fx, INTRINSICS.fy)
    return Seen(
        rays=rays[None],
        height=height[None],
        narrow=evidence.narrow[None],
        wide=evidence.wide[None],
        up=np.array([[-0.98, -0.17]]),
        focal=np.array([INTRINSICS.fx]),
    )


@pytest.fixture
def seen() -> Seen:
    keypoints, height, evidence, _ = picture()
    return seen_of(keypoints, height, evidence)


def test_left_and_right_change_places_in_a_mirror():
    assert MIRRORED[Joint.LEFT_WRIST] == Joint.RIGHT_WRIST
    assert MIRRORED[Joint.RIGHT_EAR] == Joint.LEFT_EAR
    assert MIRRORED[Joint.NOSE] == Joint.NOSE
    np.testing.assert_array_equal(MIRRORED[MIRRORED], np.arange(JOINT_COUNT))


def test_tokens_of_a_mirrored_picture_are_mirrored_tokens(seen):
    turned = Seen(
        rays=seen.rays[:, MIRRORED] * (-1.0, 1.0),
        height=seen.height[:, MIRRORED],
        narrow=seen.narrow[:, MIRRORED],
        wide=seen.wide[:, MIRRORED],
        up=seen.up,
        focal=seen.focal,
    )
    np.testing.assert_allclose(tokens_of(turned).values, mirrored(tokens_of(seen).values), atol=1e-6)


def test_each_frame_is_told_by_itself(seen):
    other = replace(seen, rays=seen.rays * 0.5, narrow=seen.narrow + 1.0)
    both = Seen(
        **{name: np.concatenate([getattr(seen, name), getattr(other, name)]) for name in Seen.__struct_fields__}
    )
    together = tokens_of(both)
    for index, alone in enumerate((seen, other)):
        np.testing.assert_array_equal(together.values[index], tokens_of(alone).values[0])


def test_no_token_has_a_number_that_is_not_finite(seen):
    for frame in (seen, _without_depth(seen), _one_joint(seen)):
        tokens = tokens_of(frame)
        assert tokens.values.shape == (1, JOINT_COUNT, TOKEN_SIZE)
        assert np.isfinite(tokens.values).all()
        assert np.isfinite(tokens.rays).all()


def test_without_depth_somebody_is_as_far_as_they_are_large(seen):
    tokens = tokens_of(_without_depth(seen))
    true = project(joints(), CAMERA)[:, 2].mean()
    assert not tokens.measured[0]
    assert tokens.depth[0] == pytest.approx(true, rel=0.2)
    assert tokens_of(_one_joint(_without_depth(seen))).depth[0] == 15.0


def test_an_answer_of_true_offsets_makes_the_true_points(seen):
    tokens = tokens_of(seen)
    pixels = project(joints(), CAMERA)
    truth = np.concatenate([seen.rays[0] * pixels[:, 2:], pixels[:, 2:]], axis=1)
    offsets = np.zeros((1, JOINT_COUNT, 3))
    offsets[0, :, 2] = pixels[:, 2] - tokens.depth[0]
    np.testing.assert_allclose(points_of(tokens, offsets)[0], truth, atol=1e-9)


def _without_depth(seen: Seen) -> Seen:
    nothing = np.full_like(seen.narrow, np.nan)
    nothing[:, :, SHARE] = 0.0
    assert LEAST == SHARE + 1
    return replace(seen, narrow=nothing, wide=nothing)


def _one_joint(seen: Seen) -> Seen:
    rays = np.full_like(seen.rays, np.nan)
    rays[:, 4] = seen.rays[:, 4]
    return replace(seen, rays=rays)
