"""What quality makes of heatmaps alone: mass, height, and which cell a pixel falls into."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception_worker.qoe import heatmap_cell, height_quality, mass_quality, quality_of_estimation
from protocol.errors import InvalidInput
from tests.perception_worker import reference_qoe


class TestMass:
    def test_one_piece_holds_all_the_mass(self):
        heatmap = np.zeros((6, 8))
        heatmap[2, 3:6] = 0.1, 0.5, 0.2
        assert mass_quality(heatmap, (2, 4)) == 1.0

    def test_two_pieces_share_the_mass_by_their_sums(self):
        heatmap = np.zeros((6, 8))
        heatmap[1, 1:3] = 0.5, 0.25
        heatmap[4, 6] = 0.25
        assert mass_quality(heatmap, (1, 1)) == pytest.approx(0.75)
        assert mass_quality(heatmap, (4, 6)) == pytest.approx(0.25)

    def test_cells_that_touch_at_a_corner_are_one_piece(self):
        heatmap = np.zeros((6, 8))
        heatmap[2, 2], heatmap[3, 3], heatmap[5, 7] = 0.5, 0.25, 0.25
        assert mass_quality(heatmap, (2, 2)) == pytest.approx(0.75)

    def test_cells_below_the_mean_neither_count_nor_connect(self):
        # The mean is 1.3 / 10 = 0.13, so 0.1 between the two peaks falls out: 0.6 and 0.6 are left.
        heatmap = np.zeros((2, 5))
        heatmap[0, 1:4] = 0.6, 0.1, 0.6
        assert mass_quality(heatmap, (0, 1)) == pytest.approx(0.5)
        assert mass_quality(heatmap, (0, 2)) == 0.0

    def test_a_negative_mean_is_taken_as_zero(self):
        # The mean is -0.1: at that threshold all cells but the -1 would count, as negative mass.
        heatmap = np.full((2, 5), -0.05)
        heatmap[0, 0], heatmap[1, 4], heatmap[1, 3] = 0.3, 0.1, -1.05
        assert mass_quality(heatmap, (0, 0)) == pytest.approx(0.75)
        assert mass_quality(heatmap, (1, 2)) == 0.0

    def test_a_cell_at_the_mean_belongs_to_its_piece(self):
        assert mass_quality(np.full((30, 40), 0.1, np.float32), (3, 4)) == 1.0

    def test_an_empty_heatmap_has_no_mass(self):
        assert mass_quality(np.zeros((3, 4)), (1, 1)) == 0.0

    @pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
    def test_a_heatmap_that_is_no_number_somewhere_is_refused(self, value):
        heatmap = np.zeros((3, 4))
        heatmap[1, 1], heatmap[2, 3] = 0.5, value
        for quality in (mass_quality, height_quality):
            with pytest.raises(InvalidInput, match="not finite"):
                quality(heatmap, (1, 1))
        with pytest.raises(InvalidInput, match="not finite"):
            quality_of_estimation(np.stack([heatmap] * 19), np.full((18, 2), -1), np.full((18, 3), np.nan))

    def test_both_infinities_do_not_cancel_each_other(self):
        with pytest.raises(InvalidInput, match="not finite"):
            mass_quality(np.array([[np.inf, -np.inf, 0.5]]), (0, 2))

    def test_a_heatmap_without_cells_is_refused(self):
        with pytest.raises(InvalidInput, match="shape"):
            mass_quality(np.zeros((0, 4)), (0, 0))

    def test_a_cell_outside_of_the_heatmap_is_refused(self):
        with pytest.raises(InvalidInput, match="outside"):
            mass_quality(np.zeros((3, 4)), (3, 0))
        with pytest.raises(InvalidInput, match="outside"):
            mass_quality(np.zeros((3, 4)), (0, -1))

    @given(st.integers(0, 2**32 - 1))
    def test_agrees_with_a_flood_fill(self, seed):
        rng = np.random.default_rng(seed)
        heatmap = rng.normal(rng.uniform(-0.5, 0.2), 1.0, rng.integers(1, 9, 2))
        cell = tuple(rng.integers(0, heatmap.shape))
        assert mass_quality(heatmap, cell) == pytest.approx(reference_qoe.mass(heatmap, cell))

    @given(st.integers(0, 2**32 - 1))
    def test_turning_the_map_upside_down_changes_nothing(self, seed):
        rng = np.random.default_rng(seed)
        heatmap = rng.normal(size=(5, 7))
        row, column = rng.integers(0, (5, 7))
        turned = mass_quality(heatmap[::-1, ::-1], (4 - row, 6 - column))
        assert turned == pytest.approx(mass_quality(heatmap, (row, column)))


class TestHeight:
    def test_is_the_value_at_the_cell(self):
        heatmap = np.zeros((6, 8))
        heatmap[2, 3] = 0.4
        assert height_quality(heatmap, (2, 3)) == pytest.approx(0.4)

    def test_is_at_most_one(self):
        heatmap = np.zeros((6, 8))
        heatmap[2, 3] = 1.2
        assert height_quality(heatmap, (2, 3)) == 1.0

    def test_is_zero_where_the_heatmap_is_below_its_mean(self):
        heatmap = np.zeros((2, 5))
        heatmap[0, 1:4] = 0.6, 0.1, 0.6
        assert height_quality(heatmap, (0, 2)) == 0.0

    def test_is_zero_where_the_heatmap_is_negative(self):
        heatmap = np.full((2, 5), -0.5)
        heatmap[0, 0] = -0.1
        assert height_quality(heatmap, (0, 0)) == 0.0

    @given(st.integers(0, 2**32 - 1))
    def test_agrees_with_the_reference(self, seed):
        rng = np.random.default_rng(seed)
        heatmap = rng.normal(rng.uniform(-0.5, 0.5), 1.0, rng.integers(1, 9, 2))
        cell = tuple(rng.integers(0, heatmap.shape))
        assert height_quality(heatmap, cell) == reference_qoe.height(heatmap, cell)

    def test_lists_and_both_sizes_of_float_are_taken(self):
        heatmap = [[0.0, 0.5, 0.0], [0.25, 0.0, 0.0]]
        for given_as in (heatmap, np.array(heatmap, np.float32), np.array(heatmap, np.float64)):
            assert height_quality(given_as, [0, 1]) == 0.5
            assert mass_quality(given_as, np.array([0, 1])) == 1.0


class TestHeatmapCell:
    @pytest.mark.parametrize(
        ("pixel", "cell"),
        [
            ((0, 0), (0, 0)),
            ((15.9, 16.0), (1, 0)),
            ((639, 479), (29, 39)),
            ((100, 200), (12, 6)),
            ((-0.5, -0.5), (0, 0)),
            ((639.5, 480.0), (29, 39)),
            ((1e9, -1e9), (0, 39)),
        ],
    )
    def test_is_the_row_and_column_of_the_pixel_scaled_down(self, pixel, cell):
        assert heatmap_cell(pixel, (480, 640), (30, 40)) == cell

    def test_rows_and_columns_have_scales_of_their_own(self):
        # The thesis's maps were square whatever the image: 28 of 640 columns, 28 of 480 rows.
        assert heatmap_cell([320.0, 120.0], [480, 640], [28, 28]) == (7, 14)

    def test_a_pixel_that_is_nowhere_is_refused(self):
        with pytest.raises(InvalidInput, match="no cell"):
            heatmap_cell((np.nan, 3.0), (480, 640), (30, 40))
