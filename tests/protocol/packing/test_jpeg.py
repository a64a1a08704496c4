"""A JPEG is nearly what it was made of; what is no JPEG of that size is told before room is made for it."""

import io

import numpy as np
import pytest
import simplejpeg
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from protocol.errors import MalformedMessage
from protocol.packing.jpeg import compress_jpeg, decompress_jpeg
from tests.protocol.values.pictures import allocating_little, colours, smooth_frame

RGB = smooth_frame().rgb


def written(picture: np.ndarray, **options) -> np.ndarray:
    """A JPEG by another library."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", **options)
    return np.frombuffer(file.getvalue(), np.uint8)


@given(colours)
def test_a_picture_of_any_size_comes_back_with_that_size(rgb):
    again = decompress_jpeg(compress_jpeg(rgb), *rgb.shape[:2])
    assert (again.dtype, again.shape) == (rgb.dtype, rgb.shape)


def test_colours_are_nearly_the_same_and_in_their_order():
    plain = np.tile(np.array([200, 100, 20], np.uint8), (48, 64, 1))
    assert np.abs(decompress_jpeg(compress_jpeg(plain), 48, 64).astype(int) - plain).max() <= 3


def test_the_same_picture_gives_the_same_bytes():
    assert compress_jpeg(RGB).tobytes() == compress_jpeg(RGB.copy()).tobytes()


def test_a_jpeg_of_another_library_is_read():
    assert decompress_jpeg(written(RGB), 48, 64).shape == (48, 64, 3)


@pytest.mark.parametrize("size", [(47, 64), (48, 65), (8192, 8192)], ids=str)
def test_a_jpeg_of_another_size_is_malformed(size):
    with pytest.raises(MalformedMessage, match="64×48 pixels came"):
        decompress_jpeg(compress_jpeg(RGB), *size)


def test_a_bomb_is_refused_before_room_is_made_for_it():
    bomb = compress_jpeg(np.zeros((8192, 8192, 3), np.uint8))
    with allocating_little(), pytest.raises(MalformedMessage, match="8192×8192 pixels came"):
        decompress_jpeg(bomb[:500_000], 48, 64)


def test_a_jpeg_told_in_many_passes_is_refused():
    with pytest.raises(MalformedMessage, match="not a baseline one"):
        decompress_jpeg(written(RGB, progressive=True), 48, 64)


def test_a_grey_picture_comes_back_in_three_colours_or_is_malformed():
    grey = simplejpeg.encode_jpeg(RGB[..., :1].copy(), colorspace="GRAY", colorsubsampling="Gray")
    assert decompress_jpeg(np.frombuffer(grey, np.uint8), 48, 64).shape == (48, 64, 3)


@given(st.data())
def test_a_jpeg_cut_off_anywhere_is_malformed(data):
    packed = compress_jpeg(RGB)
    with pytest.raises(MalformedMessage):
        decompress_jpeg(packed[: data.draw(st.integers(0, packed.size - 3))], 48, 64)


@given(st.data())
def test_a_damaged_jpeg_is_told_or_has_its_size(data):
    packed = compress_jpeg(RGB).copy()
    packed[data.draw(st.integers(0, packed.size - 1))] ^= data.draw(st.integers(1, 255))
    try:
        again = decompress_jpeg(packed, 48, 64)
    except MalformedMessage:
        return
    assert again.shape == (48, 64, 3)


@given(st.binary(max_size=64), st.booleans())
def test_noise_is_malformed(noise, begins_well):
    data = b"\xff\xd8\xff" + noise if begins_well else noise
    with pytest.raises(MalformedMessage):
        decompress_jpeg(np.frombuffer(data, np.uint8), 48, 64)
