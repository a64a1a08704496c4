"""What is packed without loss comes back to the bit; what is no such picture is told before room is made for it."""

import numpy as np
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st

from protocol.errors import MalformedMessage
from protocol.packing.lossless import compress_colours, compress_depth, decompress_colours, decompress_depth
from tests.protocol.values.pictures import allocating_little, colours, depths, smooth_frame


def as_bytes(data: bytes):
    return np.frombuffer(data, np.uint8)


@given(colours)
def test_any_colours_come_back_to_the_bit(rgb):
    again = decompress_colours(compress_colours(rgb), *rgb.shape[:2])
    assert (again.dtype, again.shape, again.tobytes()) == (rgb.dtype, rgb.shape, rgb.tobytes())


@given(depths)
def test_any_depth_comes_back_to_the_bit_nan_included(depth):
    again = decompress_depth(compress_depth(depth), *depth.shape)
    assert (again.dtype, again.shape, again.tobytes()) == (depth.dtype, depth.shape, depth.tobytes())


def test_the_same_picture_gives_the_same_bytes():
    frame = smooth_frame()
    assert compress_colours(frame.rgb).tobytes() == compress_colours(frame.rgb.copy()).tobytes()
    assert compress_depth(frame.depth).tobytes() == compress_depth(frame.depth.copy()).tobytes()


def test_what_a_camera_sees_gets_smaller():
    frame = smooth_frame()
    assert compress_colours(frame.rgb).size < frame.rgb.size / 3
    assert compress_depth(frame.depth).size < frame.depth.nbytes / 3


def test_colours_are_told_as_the_protocol_s_page_says():
    """Another language's worker is written by that page, so it is done here once more by hand."""
    rgb = np.array([[[10, 20, 30], [12, 21, 5]]], np.uint8)
    planes = [20, 1, 246, 1, 10, 230]
    assert zstandard.decompress(compress_colours(rgb).tobytes()) == bytes(planes)
    told = as_bytes(zstandard.compress(bytes(planes)))
    np.testing.assert_array_equal(decompress_colours(told, 1, 2), rgb)


@pytest.mark.parametrize(
    "big_endian_or_strided",
    [lambda depth: depth.astype(">f4"), lambda depth: np.repeat(depth, 2, axis=1)[:, ::2], np.asfortranarray],
    ids=["big-endian", "strided", "fortran order"],
)
def test_the_order_of_elements_in_memory_does_not_matter(big_endian_or_strided):
    depth = smooth_frame().depth
    assert compress_depth(big_endian_or_strided(depth)).tobytes() == compress_depth(depth).tobytes()


@pytest.mark.parametrize("size", [(479, 640), (481, 640), (8192, 8192), (1, 1)], ids=str)
def test_a_picture_of_another_size_is_malformed(size):
    packed = compress_depth(smooth_frame(480, 640).depth)
    with allocating_little(), pytest.raises(MalformedMessage, match="1228800 were announced"):
        decompress_depth(packed, *size)


def test_a_bomb_is_refused_before_room_is_made_for_it():
    bomb = zstandard.ZstdCompressor(level=19).compress(bytes(200_000_000))
    assert len(bomb) < 20_000
    for decompress in (decompress_colours, decompress_depth):
        with allocating_little(), pytest.raises(MalformedMessage, match="200000000 were announced"):
            decompress(as_bytes(bomb), 48, 64)


def test_a_bomb_that_says_nothing_of_its_size_is_refused():
    compressor = zstandard.ZstdCompressor(write_content_size=False)
    bomb = compressor.compress(bytes(200_000_000))
    with allocating_little(), pytest.raises(MalformedMessage):
        decompress_depth(as_bytes(bomb), 48, 64)


def test_a_bomb_behind_a_picture_is_refused():
    picture = compress_depth(smooth_frame().depth).tobytes()
    bomb = zstandard.compress(bytes(200_000_000))
    with allocating_little(), pytest.raises(MalformedMessage):
        decompress_depth(as_bytes(picture + bomb), 48, 64)


def test_data_that_hold_more_than_they_announce_are_malformed():
    """The size in a frame's header is 4 bytes after magic number and descriptor; here it says a row less."""
    honest = bytearray(zstandard.ZstdCompressor().compress(bytes(480 * 640 * 4)))
    assert int.from_bytes(honest[5:9], "little") == 480 * 640 * 4
    honest[5:9] = (479 * 640 * 4).to_bytes(4, "little")
    with pytest.raises(MalformedMessage):
        decompress_depth(as_bytes(bytes(honest)), 479, 640)


@given(st.data())
def test_a_picture_cut_off_anywhere_is_malformed(data):
    packed = compress_colours(smooth_frame().rgb)
    with pytest.raises(MalformedMessage):
        decompress_colours(packed[: data.draw(st.integers(0, packed.size - 1))], 48, 64)


@given(st.data())
def test_a_damaged_picture_is_told_or_is_the_same(data):
    rgb = smooth_frame().rgb
    packed = compress_colours(rgb).copy()
    packed[data.draw(st.integers(0, packed.size - 1))] ^= data.draw(st.integers(1, 255))
    try:
        again = decompress_colours(packed, 48, 64)
    except MalformedMessage:
        return
    assert again.tobytes() == rgb.tobytes()


@given(st.binary(max_size=64))
def test_noise_is_malformed(noise):
    with pytest.raises(MalformedMessage):
        decompress_depth(as_bytes(noise), 48, 64)
