import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from render_worker.people.skinning import apply, blend, bone_transforms, move_normals, move_points, vertex_normals
from render_worker.rotation import rotation

HEADS = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, 1.5], [0.0, 0.0, 2.0]])
PARENTS = (-1, 0, 1, 2)


def test_bones_that_do_not_turn_leave_everything_where_it_is():
    transforms = bone_transforms(HEADS, PARENTS, {}, {})
    np.testing.assert_array_equal(transforms, np.tile(np.eye(4), (4, 1, 1)))


def test_a_turned_bone_carries_its_children_about_its_own_head():
    transforms = bone_transforms(HEADS, PARENTS, {1: rotation((0, np.pi / 2, 0))}, {})
    np.testing.assert_allclose(apply(transforms[1], HEADS[1]), HEADS[1], atol=1e-12)
    np.testing.assert_allclose(apply(transforms[3], HEADS[3]), (1, 0, 1), atol=1e-12)


def test_a_bone_with_a_rotation_of_its_own_does_not_add_its_parents():
    level = rotation((0, np.pi / 2, 0))
    transforms = bone_transforms(HEADS, PARENTS, {1: level, 3: np.eye(3)}, {})
    np.testing.assert_allclose(apply(transforms[3], HEADS[3] + (0, 0, 1)), (1, 0, 2), atol=1e-12)


@given(st.floats(-2, 2))
def test_a_twisted_bone_leaves_the_limbs_end_where_its_parent_has_it(angle):
    bend = rotation((0.3, 0.8, 0.1))
    limb = HEADS[3] - HEADS[1]
    aside = HEADS.copy()
    # The twisting half starts off the limb's axis, and must still not move its end.
    aside[2] += (0.02, 0.01, 0.0)
    twisted = rotation(angle * bend @ limb / np.linalg.norm(limb)) @ bend
    transforms = bone_transforms(aside, PARENTS, {1: bend, 2: twisted}, {2: 1})
    np.testing.assert_allclose(apply(transforms[2], aside[3]), apply(transforms[1], aside[3]), atol=1e-9)


def test_a_vertex_between_two_bones_moves_by_the_mean_of_their_motions():
    transforms = np.tile(np.eye(4), (2, 1, 1))
    transforms[1, :3, 3] = (1.0, 0.0, 0.0)
    motions = blend(np.array([[0.75, 0.25]], np.float32), transforms)
    np.testing.assert_allclose(move_points(motions, np.zeros((1, 3), np.float32)), [[0.25, 0, 0]], atol=1e-6)


def test_normals_turn_and_do_not_shift():
    transforms = np.eye(4)[None].copy()
    transforms[0, :3, :3] = rotation((0, 0, np.pi / 2))
    transforms[0, :3, 3] = (5, 5, 5)
    motions = blend(np.ones((1, 1), np.float32), transforms)
    np.testing.assert_allclose(move_normals(motions, np.array([[1, 0, 0]], np.float32)), [[0, 1, 0]], atol=1e-6)


def test_a_vertex_normal_is_the_mean_of_its_triangles_by_area():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [9, 9, 9]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    normals = vertex_normals(vertices, triangles)
    # Areas 1/2 (upwards) and 1 (to the front).
    np.testing.assert_allclose(normals[0], np.array([2, 0, 1]) / np.sqrt(5), atol=1e-6)
    np.testing.assert_allclose(normals[1], (0, 0, 1), atol=1e-6)
    np.testing.assert_array_equal(normals[4], (0, 0, 0))


def test_the_baked_skinning_leaves_a_body_at_rest_as_it_is(assets):
    rest = assets.vertices[7]
    transforms = bone_transforms(assets.bone_heads[7].astype(float), assets.rig.parents, {}, {})
    np.testing.assert_allclose(move_points(blend(assets.rig.weights, transforms), rest), rest, atol=1e-6)
