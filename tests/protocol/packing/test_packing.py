"""A packed frame is the frame, or says that it is not."""

import msgspec
import numpy as np
import pytest
import zstandard
from msgspec import Struct
from msgspec.structs import replace

from protocol.camera import Camera
from protocol.codec import decode, encode, open_envelope, seal
from protocol.errors import LimitExceeded, MalformedMessage
from protocol.frame import ENCODINGS, Frame, Packed
from protocol.header import ReplyHeader
from protocol.limits import Limits
from protocol.messages import Render
from protocol.packing.packing import pack, unpack
from protocol.scene import Scene
from tests.protocol.values.pictures import allocating_little, camera_of, smooth_frame
from tests.protocol.values.sameness import same
from tests.protocol.values.samples import CAMERA, SCENE, packed_picture, picture

LIMITS = Limits()


def carried(message):
    """The message as it arrives."""
    parts = seal(encode(message, LIMITS), ReplyHeader(1, "x"))
    return decode(open_envelope([bytes(part) for part in parts], LIMITS), LIMITS)


@pytest.mark.parametrize("frame", [smooth_frame(), picture()], ids=["smooth", "with truth"])
@pytest.mark.parametrize("encoding", ["none", "lossless"])
def test_a_frame_comes_over_the_wire_to_the_bit(encoding, frame):
    assert same(unpack(carried(pack(frame, encoding))), carried(frame))


def test_a_jpeg_s_depth_and_all_but_its_colours_are_the_same_to_the_bit():
    frame = smooth_frame()
    opened = unpack(carried(pack(frame, "jpeg")))
    assert not same(opened, frame)
    assert same(replace(opened, rgb=frame.rgb), frame)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_a_frame_says_how_it_travels(encoding):
    packed = carried(pack(smooth_frame(), encoding))
    assert packed.encoding == encoding
    assert unpack(packed).encoding == "none"


@pytest.mark.parametrize("encoding", ["lossless", "jpeg"])
def test_a_packed_frame_is_smaller_on_the_wire(encoding):
    frame = smooth_frame()
    whole, packed = (sum(map(len, encode(one, LIMITS).arrays)) for one in (frame, pack(frame, encoding)))
    assert packed < whole / 3


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_an_opened_frame_is_read_only_as_one_that_came_unpacked(encoding):
    opened = unpack(carried(pack(smooth_frame(), encoding)))
    for array in (opened.rgb, opened.depth):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1


@pytest.mark.parametrize("change", [{"rgb": b""}, {"depth": b""}, {"rgb": bytes(64)}, {"depth": bytes(64)}], ids=str)
@pytest.mark.parametrize("encoding", ["lossless", "jpeg"])
def test_a_frame_of_other_bytes_is_malformed(encoding, change):
    frame = pack(smooth_frame(), encoding)
    spoilt = {name: np.frombuffer(data, np.uint8) for name, data in change.items()}
    with pytest.raises(MalformedMessage):
        unpack(replace(frame, packed=replace(frame.packed, **spoilt)))


def test_a_frame_packed_as_another_encoding_than_it_says_is_malformed():
    frame = pack(smooth_frame(), "lossless")
    with pytest.raises(MalformedMessage):
        unpack(replace(frame, packed=replace(frame.packed, encoding="jpeg")))


def test_a_frame_larger_than_what_travels_is_neither_packed_nor_opened():
    """Some bytes may announce any size: 4097 × 4097 pixels would be 67 MB of depth."""
    side = 4097
    nothing = np.frombuffer(zstandard.compress(bytes(side * side * 4)), np.uint8)
    bomb = Frame(
        rgb=np.zeros((0, 0, 3), np.uint8),
        depth=np.zeros((0, 0), np.float32),
        camera=camera_of(side, side),
        packed=Packed(encoding="lossless", rgb=nothing, depth=nothing),
    )
    with allocating_little(), pytest.raises(LimitExceeded, match="a picture of 4097×4097 pixels"):
        unpack(bomb)
    with pytest.raises(LimitExceeded, match="a picture of 64×48"):
        pack(smooth_frame(), "lossless", Limits(array_bytes=10_000))
    with pytest.raises(LimitExceeded, match="a picture of 64×48"):
        unpack(pack(smooth_frame(), "lossless"), Limits(message_bytes=20_000))


def test_a_frame_is_packed_or_has_arrays_and_never_both():
    frame = smooth_frame()
    packed = pack(frame, "lossless").packed
    with pytest.raises(ValueError, match="rgb has shape"):
        replace(frame, packed=packed)
    with pytest.raises(ValueError, match="rgb has shape"):
        replace(pack(frame, "lossless"), packed=None)


def test_an_old_worker_passes_over_the_wish_and_an_old_client_has_none():
    class OldRender(Struct, frozen=True):
        scene: Scene
        camera: Camera
        truth: bool = False

    new = msgspec.msgpack.encode(Render(scene=SCENE, camera=CAMERA, encoding="lossless"))
    old = msgspec.msgpack.decode(new, type=OldRender)
    assert (old.scene, old.camera) == (SCENE, CAMERA)
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(old), type=Render).encoding == "none"


def test_an_encoding_that_is_none_is_malformed():
    with pytest.raises(MalformedMessage, match="encoding"):
        carried(replace(packed_picture(), packed=replace(packed_picture().packed, encoding="png")))
