"""What a region is, and the way between its pixels, its maps' cells and the whole picture."""

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from protocol.camera import Intrinsics
from protocol.codec import decode, encode, open_envelope, seal
from protocol.errors import InvalidInput, MalformedMessage
from protocol.header import RequestHeader
from protocol.limits import Limits
from protocol.messages import Render
from protocol.packing.packing import pack
from protocol.region import Region, require_in_picture
from tests.protocol.values.samples import CAMERA, SCENE, picture
from tests.protocol.values.strategies import regions

WHOLE = Region.whole(480, 640)
VGA = Intrinsics.from_horizontal_fov(640, 480, 70.0)


class TestWhatIsNone:
    @pytest.mark.parametrize("size", [(0, 10), (10, 0), (-3, 10)])
    def test_an_empty_region_is_refused(self, size):
        with pytest.raises(ValueError, match="empty"):
            Region(0, 0, *size)

    @pytest.mark.parametrize("corner", [(-1, 0), (0, -1)])
    def test_a_region_that_begins_outside_is_refused(self, corner):
        with pytest.raises(ValueError, match="outside"):
            Region(*corner, 10, 10)

    @pytest.mark.parametrize("region", [Region(600, 0, 41, 10), Region(0, 471, 10, 10), Region(10**9, 0, 1, 1)])
    def test_a_region_that_ends_outside_is_refused_by_who_knows_the_camera(self, region):
        with pytest.raises(ValueError, match="is not in a picture of 640×480"):
            require_in_picture(region, VGA)

    @pytest.mark.parametrize(
        "region", [{"left": 7, "top": 0, "width": 2, "height": 1}, {"left": 0, "top": 0, "width": 0, "height": 1}]
    )
    def test_on_the_wire_both_are_malformed(self, region):
        [prelude, header, body] = seal(
            encode(Render(scene=SCENE, camera=CAMERA), Limits()), RequestHeader(request=1, incarnation="a", deadline=1)
        )
        told = msgspec.msgpack.encode(msgspec.msgpack.decode(body) | {"region": region})
        with pytest.raises(MalformedMessage, match="region"):
            decode(open_envelope([prelude, header, told], Limits()), Limits())


class TestFrame:
    @given(regions(6, 8), st.data())
    def test_a_part_of_a_part_is_that_part_of_the_whole(self, region, data):
        inner = data.draw(regions(region.height, region.width))
        inner = replace(inner, left=inner.left + region.left, top=inner.top + region.top)
        twice, once = picture().part(region).part(inner), picture().part(inner)
        assert twice.area == inner
        assert twice.rgb.tobytes() == once.rgb.tobytes() == inner.part(picture().rgb).tobytes()
        assert twice.depth.tobytes() == once.depth.tobytes()

    def test_what_it_does_not_show_can_not_be_cut_out_of_it(self):
        with pytest.raises(InvalidInput, match="can't be cut"):
            picture().part(Region(0, 0, 4, 4)).part(Region(2, 2, 4, 4))

    def test_a_packed_one_can_not_be_cut(self):
        with pytest.raises(InvalidInput, match="came as lossless"):
            pack(picture(), "lossless").part(Region(0, 0, 4, 4))

    def test_arrays_of_another_size_than_the_region_s_are_refused(self):
        with pytest.raises(ValueError, match="rgb has shape"):
            replace(picture(), region=Region(0, 0, 4, 4))


class TestPixels:
    def test_a_cell_s_centre_is_the_centre_of_the_pixels_that_it_covers(self):
        # Cell 0 of 40 covers the pixels 0 to 15 of 640, whose centre is at 7.5; cell (39, 29) ends at (639, 479).
        pixels = WHOLE.pixels(np.array([[0.0, 0.0], [39.0, 29.0], [0.5, 1.0]]), (30, 40))
        assert pixels == pytest.approx(np.array([[7.5, 7.5], [631.5, 471.5], [15.5, 23.5]]))

    def test_of_a_crop_are_moved_and_scaled_with_it(self):
        # 4 pixels to a cell: the first covers columns 100 to 103.
        pixels = Region(100, 50, 160, 120).pixels(np.array([[0.0, 0.0]]), (30, 40))
        assert pixels == pytest.approx(np.array([[101.5, 51.5]]))

    @given(regions(480, 640), st.integers(0, 29), st.integers(0, 39))
    def test_of_a_cell_s_centre_fall_back_into_the_cell(self, region, row, column):
        pixel = region.inside(region.pixels(np.array([[column, row]], float), (30, 40)))[0]
        # Where a cell is smaller than a pixel, its centre may belong to the pixel before.
        if region.width > 40 and region.height > 30:
            cell = np.floor(pixel * (40, 30) / (region.width, region.height))
            assert cell.tolist() == [column, row]

    def test_that_are_nowhere_stay_nowhere(self):
        assert np.isnan(WHOLE.pixels(np.full((2, 2), np.nan), (30, 40))).all()


def test_a_part_of_a_picture_is_what_the_region_shows():
    rgb = np.zeros((480, 640, 3), np.uint8)
    rgb[100:148, 200:264] = 10, 20, 30
    part = Region(200, 100, 64, 48).part(rgb)
    assert part.shape == (48, 64, 3)
    assert (part == (10, 20, 30)).all()
