import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.lifting import LIFTINGS, lift, patch_depth, windows_around, within_reach
from protocol.camera import Camera, CameraPose, Intrinsics, project

LEVEL = Camera(
    pose=CameraPose(position=(0.0, 0.0, 1.5), target=(3.0, 0.0, 1.5)),
    intrinsics=Intrinsics(width=640, height=480, fx=400.0, fy=400.0, cx=320.0, cy=240.0),
)
"""Looks along the world's x axis; the image's right is the world's -y, its down the world's -z."""

TILTED = Camera(
    pose=CameraPose(position=(1.0, -2.0, 2.5), target=(4.0, 1.0, 1.0)),
    intrinsics=Intrinsics.from_horizontal_fov(640, 480, 70.0),
)


def plane(slope_x, slope_y, at_centre=4.0):
    rows, columns = np.mgrid[:480, :640]
    return (at_centre + slope_x * (columns - 320) + slope_y * (rows - 240)).astype(np.float32)


class TestPatchDepth:
    def test_on_a_tilted_plane_is_the_depth_of_the_pixel_itself(self):
        assert patch_depth(plane(0.002, -0.003), (420, 140)) == pytest.approx(4 + 0.2 + 0.3, abs=1e-6)

    def test_covers_three_pixels_to_each_side(self):
        depth = np.full((480, 640), 2.0, np.float32)
        depth[97:104, 197:204] = 5.0
        assert patch_depth(depth, (200, 100)) == 5.0
        # One column of the seven is outside of the square.
        assert patch_depth(depth, (201, 100)) == pytest.approx((6 * 5 + 2) / 7)
        assert patch_depth(depth, (200, 101)) == pytest.approx((6 * 5 + 2) / 7)

    def test_belongs_to_the_nearest_pixel(self):
        depth = plane(0.01, 0.0)
        assert patch_depth(depth, (300.4, 200)) == patch_depth(depth, (300, 200))
        assert patch_depth(depth, (300.6, 200)) == patch_depth(depth, (301, 200))

    @pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 0.0, 1.49, 15.01, -3.0])
    def test_leaves_out_what_is_not_finite_or_out_of_range(self, bad):
        depth = np.full((480, 640), 3.0, np.float32)
        depth[100, 197:204] = bad
        depth[101, 200] = 7.0
        assert patch_depth(depth, (200, 100)) == pytest.approx((41 * 3 + 7) / 42)

    @pytest.mark.parametrize("bound", [1.5, 15.0])
    def test_takes_the_ends_of_the_range(self, bound):
        assert patch_depth(np.full((20, 20), bound, np.float32), (10, 10)) == bound

    @pytest.mark.parametrize("bad", [np.nan, 0.0, 1.0, 20.0])
    def test_is_nan_when_no_value_is_left(self, bad):
        depth = np.full((20, 20), 3.0, np.float32)
        depth[7:14, 7:14] = bad
        assert np.isnan(patch_depth(depth, (10, 10)))

    def test_is_cut_off_at_the_borders_of_the_image(self):
        depth = np.full((20, 30), 9.0, np.float32)
        depth[:4, :4] = 2.0
        assert patch_depth(depth, (0, 0)) == 2.0
        depth[16:, 26:] = 3.0
        assert patch_depth(depth, (29, 19)) == 3.0

    def test_is_nan_outside_of_the_image(self):
        depth = np.full((20, 30), 9.0, np.float32)
        assert np.isnan(patch_depth(depth, (-4, 10)))
        assert np.isnan(patch_depth(depth, (10, 23)))
        assert np.isnan(patch_depth(depth, (1e12, 10)))
        assert np.isnan(patch_depth(depth, (np.nan, 10)))

    def test_takes_lists(self):
        assert patch_depth([[2.0, 4.0], [np.nan, 99.0]], [0, 0]) == 3.0


def placed(depth, pixels, camera, lifting="mean"):
    return lift(windows_around(depth, pixels), pixels, camera, lifting)


class TestLift:
    def test_goes_through_the_pinhole_into_the_world(self):
        # 100 pixels right and 50 up at 4 m: 1 m to the right (-y), 0.5 m above the camera.
        points = placed(np.full((480, 640), 4.0, np.float32), np.array([[420.0, 190.0]]), LEVEL)
        assert points[0] == pytest.approx([4.0, -1.0, 2.0])

    def test_on_a_tilted_plane_finds_points_of_the_plane(self):
        # At pixel (420, 140) the plane is 4.5 m away: x = 4.5, y = -4.5 / 4, z = 1.5 + 4.5 / 4.
        points = placed(plane(0.002, -0.003), np.array([[420.0, 140.0]]), LEVEL)
        assert points[0] == pytest.approx([4.5, -1.125, 2.625], abs=1e-5)

    def test_a_keypoint_without_depth_or_without_place_is_not_located(self):
        depth = np.full((480, 640), 4.0, np.float32)
        depth[:200] = np.nan
        points = placed(depth, np.array([[100.0, 100.0], [np.nan, np.nan], [100.0, 300.0]]), LEVEL)
        assert np.isnan(points[:2]).all()
        assert np.isfinite(points[2]).all()

    @given(st.floats(-200, 200), st.floats(-150, 150), st.floats(1.5, 15))
    def test_undoes_the_camera_s_projection(self, right, down, metres):
        pixel = np.array([[319.5 + right, 239.5 + down]])
        points = placed(np.full((480, 640), metres), pixel, TILTED)
        assert project(points, TILTED)[0] == pytest.approx([*pixel[0], metres])

    def test_places_by_the_choice_that_it_is_given(self):
        depth = np.full((480, 640), 8.0, np.float32)
        depth[:, :320] = 4.0
        pixel = np.array([[319.0, 240.0]])
        # Four of the seven columns are in front.
        for lifting, metres in (("mean", (4 * 4 + 3 * 8) / 7), ("median", 4.0), ("nearest", 4.0)):
            assert placed(depth, pixel, LEVEL, lifting)[0, 0] == pytest.approx(metres)


def windows_of(*values):
    """One keypoint, with these depths around it and none besides."""
    depth = np.full((7, 7), np.nan, np.float64)
    depth.flat[: len(values)] = values
    return windows_around(depth, np.array([[3.0, 3.0]]))


class TestChoices:
    def test_the_mean_takes_all(self):
        assert LIFTINGS["mean"](windows_of(2.0, 3.0, 7.0)) == pytest.approx([4.0])

    def test_the_median_is_the_middle_one_or_between_the_middle_two(self):
        assert LIFTINGS["median"](windows_of(9.0, 2.0, 3.0)) == [3.0]
        assert LIFTINGS["median"](windows_of(9.0, 2.0, 3.0, 5.0)) == [4.0]
        assert LIFTINGS["median"](windows_of(2.5)) == [2.5]

    def test_the_nearest_is_the_surface_about_the_lower_quartile(self):
        # Of nine the third is at the quartile, 2.2; within 0.3 m of it lie 2.0, 2.1, 2.2, 2.3 and 2.5.
        values = (2.0, 2.1, 2.2, 2.3, 2.5, 6.0, 6.0, 6.1, 6.2)
        assert LIFTINGS["nearest"](windows_of(*values)) == pytest.approx([2.22])

    def test_the_nearest_passes_over_a_stray_value_in_front(self):
        assert LIFTINGS["nearest"](windows_of(1.5, 4.0, 4.1, 4.2, 4.0)) == pytest.approx([4.075])

    @pytest.mark.parametrize("lifting", LIFTINGS)
    def test_each_is_nan_where_nothing_is_believed(self, lifting):
        assert np.isnan(LIFTINGS[lifting](windows_of(0.5, 20.0, np.inf))).all()

    @given(st.lists(st.floats(1.5, 15), min_size=1, max_size=49))
    def test_each_lies_between_the_nearest_and_the_farthest(self, values):
        for choice in LIFTINGS.values():
            assert min(values) - 1e-9 <= choice(windows_of(*values))[0] <= max(values) + 1e-9

    def test_the_spread_is_from_the_nearest_to_the_farthest_that_is_believed(self):
        assert windows_of(0.3, 2.0, 7.5, 99.0).spread == [5.5]
        assert windows_of(2.0).spread == [0.0]
        assert np.isnan(windows_of().spread).all()


class TestReach:
    BODY = np.array([[4.0, 0.0, 1.6], [4.0, 0.2, 1.2], [4.0, -0.2, 0.8], [4.0, 0.0, 0.1]])

    def test_of_a_body_holds_all_of_it(self):
        assert (within_reach(self.BODY) == self.BODY).all()

    def test_leaves_out_what_is_behind(self):
        # The middle is (4, 0, 1): the median of the heights 0.1, 0.8, 1.2, 1.6 and 1.0.
        points = np.vstack([self.BODY, [[5.6, 0.0, 1.0]]])
        assert np.isnan(within_reach(points)[-1]).all()
        assert (within_reach(points)[:-1] == self.BODY).all()

    @given(st.floats(0.0, 3.0))
    def test_ends_a_metre_and_a_half_from_the_middle(self, away):
        points = np.vstack([self.BODY, self.BODY, [[4.0 + away, 0.0, 1.0]]])
        assert np.isfinite(within_reach(points)[-1]).all() == (away <= 1.5)

    def test_is_asked_of_located_joints_alone(self):
        points = np.vstack([np.full((14, 3), np.nan), self.BODY])
        assert within_reach(points) == pytest.approx(points, nan_ok=True)
        assert np.isnan(within_reach(np.full((18, 3), np.nan))).all()
