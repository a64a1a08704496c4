"""A message arrives as it was sent, and every broken message is detected."""

import msgspec
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from protocol.codec import decode, decode_header, encode, open_envelope, seal
from protocol.errors import InvalidInput, LimitExceeded, MalformedMessage, ProtocolError, VersionMismatch
from protocol.frame import Frame
from protocol.header import ReplyHeader, RequestHeader
from protocol.limits import Limits
from protocol.messages import MESSAGE_NUMBERS, Failure, Hello, Ping, Render, Role, Welcome
from tests.protocol.values.sameness import same
from tests.protocol.values.samples import CAMERA, SCENE, picture, samples
from tests.protocol.values.strategies import MESSAGES, messages, spoilt

LIMITS = Limits()
HEADER = RequestHeader(7, "0123456789abcdef", 2.5)


def parts_of(message, limits=LIMITS):
    return [bytes(part) for part in seal(encode(message, limits), HEADER)]


def read(parts, limits=LIMITS):
    return decode(open_envelope(parts, limits), limits)


def with_description(parts, field, **changes):
    """The same parts, with the description of one array changed in the body."""
    body = msgspec.msgpack.decode(parts[2])
    body[field] |= changes
    return [*parts[:2], msgspec.msgpack.encode(body), *parts[3:]]


@given(messages)
def test_every_message_comes_back_to_the_bit(message):
    assert same(read(parts_of(message)), message)


def test_every_message_has_a_strategy_and_a_sample():
    assert MESSAGES.keys() == MESSAGE_NUMBERS.keys() == {type(sample) for sample in samples()}


@given(request=st.integers(0, 2**63 - 1), incarnation=st.text(max_size=64), seconds=st.floats(0, 1e9))
def test_headers_come_back(request, incarnation, seconds):
    asked = RequestHeader(request, incarnation, seconds)
    answered = ReplyHeader(request, incarnation, queue=seconds, compute=seconds / 2)
    assert decode_header(msgspec.msgpack.encode(asked), RequestHeader) == asked
    assert decode_header(msgspec.msgpack.encode(answered), ReplyHeader) == answered


def test_the_first_part_is_version_and_number_in_little_endian():
    assert parts_of(Render(scene=SCENE, camera=CAMERA))[0] == b"\x01\x00\x12\x00"


def test_arrays_are_read_only_views_of_what_arrived():
    parts = parts_of(picture())
    parts[3] = bytearray(parts[3])
    frame = read(parts)
    assert np.shares_memory(frame.rgb, np.frombuffer(parts[3], np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        frame.rgb[0, 0, 0] = 1


def test_contiguous_arrays_are_sent_without_a_copy():
    frame = picture()
    payload = encode(frame, LIMITS)
    assert np.shares_memory(np.frombuffer(payload.arrays[0], np.uint8), frame.rgb)


@pytest.mark.parametrize(
    "turn",
    [
        lambda array: np.asfortranarray(array),
        lambda array: np.repeat(array, 2, axis=0)[::2],
        lambda array: array[::-1][::-1],
        lambda array: array.astype(array.dtype.newbyteorder(">")),
    ],
    ids=["fortran order", "strided", "turned twice", "big-endian"],
)
def test_the_order_of_elements_in_memory_does_not_matter(turn):
    frame = picture()
    turned = Frame(rgb=turn(frame.rgb), depth=turn(frame.depth), camera=CAMERA)
    arrived = read(parts_of(turned))
    assert same(arrived, Frame(rgb=frame.rgb, depth=frame.depth, camera=CAMERA))


def test_an_array_of_objects_is_not_sent():
    frame = Frame(rgb=np.full((6, 8, 3), None), depth=picture().depth, camera=CAMERA)
    with pytest.raises(InvalidInput, match="an array of object can't be sent"):
        encode(frame, LIMITS)


def test_what_is_no_message_is_not_sent():
    with pytest.raises(InvalidInput, match="a Scene is not a message"):
        encode(SCENE, LIMITS)


def test_a_value_of_a_foreign_type_is_not_sent():
    with pytest.raises(InvalidInput, match="a complex can't be sent"):
        encode(Failure(code="x", message=1j), LIMITS)


@pytest.mark.parametrize(
    ("limits", "what"),
    [
        (Limits(array_bytes=100), "an array of 144 bytes"),
        (Limits(arrays=3), "a message with 4 arrays"),
        (Limits(body_bytes=100), r"a body of \d+ bytes"),
        (Limits(message_bytes=500), r"a message of \d+ bytes"),
    ],
    ids=["array", "arrays", "body", "message"],
)
def test_what_is_too_large_is_neither_sent_nor_taken(limits, what):
    with pytest.raises(LimitExceeded, match=what):
        encode(picture(), limits)
    with pytest.raises(LimitExceeded, match=what):
        open_envelope(parts_of(picture()), limits)


def test_a_header_that_is_too_large_is_not_taken():
    parts = parts_of(Ping())
    with pytest.raises(LimitExceeded, match="a header of 4097 bytes"):
        open_envelope([parts[0], bytes(4097), *parts[2:]], LIMITS)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_parts_are_malformed(count):
    with pytest.raises(MalformedMessage, match=f"at least 3 parts, {count} came"):
        read(parts_of(Ping())[:count])


@pytest.mark.parametrize("prelude", [b"", b"\1\0\3", b"\1\0\3\0\0"])
def test_a_first_part_of_another_size_is_malformed(prelude):
    with pytest.raises(MalformedMessage, match=f"the first part has 4 bytes, {len(prelude)} came"):
        read([prelude, *parts_of(Ping())[1:]])


def test_an_unknown_message_number_is_malformed():
    with pytest.raises(MalformedMessage, match="no message has the number 999"):
        read([b"\1\0\xe7\3", *parts_of(Ping())[1:]])


def test_another_version_is_a_version_mismatch():
    parts = parts_of(Ping())
    with pytest.raises(VersionMismatch, match="Ping came in version 9 of the protocol; this side speaks 1 to 1"):
        read([b"\x09\0" + parts[0][2:], *parts[1:]])


@pytest.mark.parametrize(
    "message",
    [
        Hello(oldest_version=7, newest_version=9, role=Role.AGENT, incarnation="x"),
        Welcome(version=9, role=Role.RENDER, incarnation="x", heartbeat=1.0),
        Failure(code="version-mismatch", message="x"),
    ],
    ids=lambda message: type(message).__name__,
)
def test_what_the_handshake_needs_is_read_in_any_version(message):
    parts = parts_of(message)
    assert same(read([b"\x09\0" + parts[0][2:], *parts[1:]]), message)


def test_a_missing_array_part_is_malformed():
    with pytest.raises(MalformedMessage, match=r"array part 3 is not there - at `\$.visible`"):
        read(parts_of(picture())[:-1])


def test_an_array_part_that_no_field_describes_is_malformed():
    with pytest.raises(MalformedMessage, match="5 array parts came, the body describes 4"):
        read([*parts_of(picture()), b"more"])


def test_an_array_part_described_twice_is_malformed():
    parts = with_description(parts_of(picture()), "depth", index=0)
    with pytest.raises(MalformedMessage, match=r"array part 0 is described twice - at `\$.depth`"):
        read(parts)


@pytest.mark.parametrize("index", [-4, 4, 2**64 - 1, "0", 0.5, None])
def test_an_index_that_is_none_is_malformed(index):
    with pytest.raises(MalformedMessage):
        read(with_description(parts_of(picture()), "rgb", index=index))


@pytest.mark.parametrize("dtype", ["object", "O", "str", "datetime64", "complex128", "float128", ">f4", "V8", ""])
def test_an_element_type_that_does_not_travel_is_malformed(dtype):
    with pytest.raises(MalformedMessage, match=f"arrays of '{dtype}' don't travel"):
        read(with_description(parts_of(picture()), "depth", dtype=dtype))


def test_an_element_type_other_than_annotated_is_malformed():
    parts = with_description(parts_of(picture()), "depth", dtype="int32")
    with pytest.raises(MalformedMessage, match=r"an array of int32 came where float32 belongs - at `\$.depth`"):
        read(parts)


def test_a_float64_where_float32_belongs_is_malformed():
    frame = Frame(rgb=picture().rgb, depth=picture().depth.astype(float), camera=CAMERA)
    with pytest.raises(MalformedMessage, match="an array of float64 came where float32 belongs"):
        read(parts_of(frame))


@pytest.mark.parametrize(
    "shape",
    [
        [6, 8, 2],
        [6],
        [],
        [2**62, 2**62, 2**62, 2**62],
        [2**63 - 1, 2],
        [1] * 8 + [48],
        "68",
        [6.0, 8],
        None,
    ],
    ids=str,
)
def test_a_shape_that_its_part_does_not_have_is_malformed(shape):
    with pytest.raises(MalformedMessage):
        read(with_description(parts_of(picture()), "depth", shape=shape))


@pytest.mark.parametrize("shape", [[-6, -8], [-1, 8], [6, -8]], ids=str)
def test_a_negative_length_is_malformed(shape):
    with pytest.raises(MalformedMessage, match="Expected `int` >= 0"):
        read(with_description(parts_of(picture()), "depth", shape=shape))


@pytest.mark.parametrize("shape", [[2**32, 2**30], [2**62], [2**31, 2**31, 2**31]], ids=str)
def test_a_size_that_is_0_in_64_bits_is_not_taken_for_0(shape):
    parts = with_description(parts_of(picture()), "depth", shape=shape)
    parts[4] = b""
    with pytest.raises(MalformedMessage, match=r"takes \d{20,} bytes, 0 came"):
        read(parts)


@pytest.mark.parametrize("shape", [[0, 2**62], [2**40, 0, 2**40], [0, 2**64 - 1]], ids=str)
def test_an_empty_array_of_endless_shape_is_malformed(shape):
    parts = with_description(parts_of(picture()), "depth", shape=shape)
    parts[4] = b""
    with pytest.raises(MalformedMessage, match="larger than any array may be"):
        read(parts)


@pytest.mark.parametrize("change", [-1, 1])
def test_a_part_of_another_length_than_its_shape_is_malformed(change):
    parts = parts_of(picture())
    parts[4] = bytes(len(parts[4]) + change)
    with pytest.raises(MalformedMessage, match=rf"float32 of shape \(6, 8\) takes 192 bytes, {192 + change} came"):
        read(parts)


def test_a_bool_that_is_neither_true_nor_false_is_malformed():
    parts = parts_of(picture())
    parts[6] = bytes([2] * 18)
    with pytest.raises(MalformedMessage, match="a bool is 0 or 1"):
        read(parts)


def test_a_frame_of_another_size_than_its_camera_is_malformed():
    parts = with_description(parts_of(picture()), "depth", shape=[8, 6])
    with pytest.raises(MalformedMessage, match=r"depth has shape \(8, 6\), not 6×8"):
        read(parts)


@pytest.mark.parametrize(
    "body", [b"", b"\xc1", b"\x80", b"\xdf\xff\xff\xff\xff", b"\x91" * 100_000, b"\x81\xa1x\xdb\0\0\0\1\xff"]
)
def test_a_body_that_is_no_struct_is_malformed(body):
    with pytest.raises(MalformedMessage):
        read([*parts_of(Render(scene=SCENE, camera=CAMERA))[:2], body])


@pytest.mark.parametrize(
    "header",
    [
        b"",
        b"\xc0",
        b"\x81\xa1x" + b"\x91" * 4000,
        b"\x81\xabincarnation\xa1\xff",
        msgspec.msgpack.encode({"request": -1, "incarnation": "x", "deadline": 1.0}),
        msgspec.msgpack.encode({"request": 2**63, "incarnation": "x", "deadline": 1.0}),
        msgspec.msgpack.encode({"request": 1, "incarnation": "x" * 65, "deadline": 1.0}),
        msgspec.msgpack.encode({"request": 1, "incarnation": "x", "deadline": float("nan")}),
        msgspec.msgpack.encode({"request": 1, "incarnation": "x", "deadline": -1.0}),
        msgspec.msgpack.encode({"request": 1, "incarnation": "x"}),
    ],
)
def test_a_header_out_of_range_is_malformed(header):
    with pytest.raises(MalformedMessage, match="RequestHeader"):
        decode_header(header, RequestHeader)


def test_fields_of_a_later_minor_change_are_passed_over():
    parts = parts_of(Ping())
    assert same(read([*parts[:2], msgspec.msgpack.encode({"added_in_1_7": [1, {"a": 2}]})]), Ping())


@given(messages, st.data())
def test_damage_anywhere_is_told_or_harmless(message, data):
    parts = parts_of(message)
    place = data.draw(st.integers(0, len(parts) - 1))
    broken = bytearray(parts[place])
    for _ in range(data.draw(st.integers(1, 4))):
        if broken:
            broken[data.draw(st.integers(0, len(broken) - 1))] = data.draw(st.integers(0, 255))
    parts[place] = bytes(broken[: data.draw(st.integers(0, len(broken)))])
    try:
        read(parts)
    except ProtocolError:
        return


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_a_spoilt_message_of_every_kind_is_told_or_means_what_it_says(kind, data):
    parts = data.draw(spoilt(parts_of(data.draw(MESSAGES[kind]))))
    try:
        message = read(parts)
    except ProtocolError:
        return
    assert same(read(parts_of(message)), message)


@pytest.mark.parametrize("kind", MESSAGES, ids=lambda kind: kind.__name__)
def test_a_message_cut_off_anywhere_is_malformed(kind):
    for parts in (parts_of(sample) for sample in samples() if type(sample) is kind):
        for place in range(2, len(parts)):
            for length in range(len(parts[place])):
                with pytest.raises(ProtocolError):
                    read([*parts[:place], parts[place][:length], *parts[place + 1 :]])


@given(st.lists(st.binary(max_size=64), max_size=8))
def test_noise_is_told_or_harmless(parts):
    try:
        read(parts)
    except ProtocolError:
        return


@given(number=st.sampled_from(sorted(MESSAGE_NUMBERS.values())), body=st.binary(max_size=200))
def test_a_noisy_body_is_told_or_harmless(number, body):
    try:
        read([bytes([1, 0, number, 0]), b"", body])
    except ProtocolError:
        return
