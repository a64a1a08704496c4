import numpy as np
import pytest

from benchmarks.accelerator.differences import difference, differences, digest


def test_a_difference_counts_what_both_have():
    found = difference("x", np.array([1.0, 2.0, 3.0, np.nan]), np.array([1.0, 2.5, np.nan, np.nan]))
    assert (found.median, found.largest, found.unequal, found.one_sided) == (0.25, 0.5, 0.5, 1)


def test_where_nobody_was_found_there_is_no_difference():
    found = difference("x", np.full(3, np.nan), np.full(3, np.nan))
    assert (found.largest, found.one_sided) == (0.0, 0)


def test_quantities_are_told_in_their_units_and_only_where_both_have_them():
    expected = {"rgb": np.array([3], np.uint8), "points": np.array([1.0])}
    found = {"rgb": np.array([5], np.uint8), "points": np.array([1.002]), "quality": np.array([0.5])}
    by_name = {one.quantity: one.largest for one in differences(expected, found)}
    assert by_name == {"colours, levels of 255": 2.0, "points, mm": pytest.approx(2.0)}


def test_what_stands_before_a_slash_is_said_with_the_quantity():
    points = {"track/points": np.array([1.0])}
    assert [one.quantity for one in differences(points, points)] == ["track: points, mm"]


def test_a_digest_is_of_names_and_bytes():
    array = np.arange(6.0).reshape(2, 3)
    others = {"b": array}, {"a": array + 1.0}, {"a": array.astype(np.float32)}
    assert digest({"a": array}) == digest({"a": array.copy()})
    assert digest({"a": array}) not in {digest(other) for other in others}
    assert digest({"a": array.T}) == digest({"a": np.ascontiguousarray(array.T)})
