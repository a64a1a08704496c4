"""Limits are sizes and counts."""

import pytest

from protocol import Limits
from protocol.errors import InvalidConfig


@pytest.mark.parametrize("name", Limits.__struct_fields__)
def test_a_limit_that_lets_nothing_through_is_refused_by_name(name):
    with pytest.raises(InvalidConfig, match=f"limits.{name} is 0; it must be at least 1"):
        Limits(**{name: 0})


def test_a_socket_takes_the_largest_part_of_any_kind():
    assert Limits(header_bytes=1, body_bytes=3, array_bytes=2).part_bytes == 3


def test_a_message_has_three_parts_and_its_arrays():
    assert Limits(arrays=4).parts == 7


def test_a_frame_of_four_thousand_pixels_each_way_fits():
    rgb, depth = 4096 * 4096 * 3, 4096 * 4096 * 4
    assert depth <= Limits().array_bytes
    assert rgb + depth < Limits().message_bytes
