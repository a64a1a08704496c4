"""Encodes messages as multipart frames, and decodes them.

`[version+type][header][body][array 0][array 1]…`: the first part is two little-endian 16-bit numbers, header and body
are msgpack maps, and an array's elements are a part of their own that the body describes (`protocol.array_part`).
`Hello`, `Welcome`, `Failure` and the headers are the same in every version, so that both sides can report a mismatch.
"""

import re
import struct
from collections.abc import Sequence
from typing import Any, TypeVar, cast

import msgspec
import numpy as np
from msgspec import Struct

from protocol.array_part import ArrayDescription, ArrayParts, Part, array_part
from protocol.arrays import AnyArray, WrongArray
from protocol.catalogue import Message, MessageType, message_type
from protocol.errors import ImpossibleValue, InvalidInput, LimitExceeded, MalformedMessage, VersionMismatch
from protocol.header import ReplyHeader, RequestHeader, RequestNumber
from protocol.limits import Limits
from protocol.messages import (
    MESSAGE_NUMBERS,
    OLDEST_PROTOCOL_VERSION,
    PROTOCOL_VERSION,
    Failure,
    Hello,
    Welcome,
)
from protocol.text import UNDECODABLE

_PRELUDE = struct.Struct("<HH")
_EVERY_VERSION: frozenset[MessageType] = frozenset({Hello, Welcome, Failure})

# A bound that a number breaks, in msgspec's words; a value of another type reads "Expected `float`, got `str`".
_OUT_OF_BOUNDS = re.compile(r"Expected `(?:int|float)` (?:[<>]|that)")

HeaderT = TypeVar("HeaderT", RequestHeader, RequestNumber, ReplyHeader)


class Payload(Struct, frozen=True, eq=False):
    """The parts of a message without its header, which are the same in each try."""

    number: int
    body: bytes
    arrays: tuple[Part, ...]


class Envelope(Struct, frozen=True, eq=False):
    """A received message whose sizes are checked and whose body is not decoded yet."""

    version: int
    number: int
    header: Part
    body: Part
    arrays: tuple[Part, ...]


def encode(message: Message, limits: Limits) -> Payload:
    """Encode a message. Its arrays are not copied; do not change them until it is sent.

    Raises:
        InvalidInput: a value can't travel, such as an array of objects.
        LimitExceeded: the message is larger than `limits` allow.
    """
    arrays: list[Part] = []

    def describe(value: Any) -> ArrayDescription:
        if not isinstance(value, np.ndarray):
            raise InvalidInput(f"a {type(value).__name__} can't be sent")
        array = cast("AnyArray", value)
        name, part = array_part(array)
        arrays.append(part)
        return ArrayDescription(dtype=name, shape=array.shape, index=len(arrays) - 1)

    number = MESSAGE_NUMBERS.get(type(message))
    if number is None:
        raise InvalidInput(f"a {type(message).__name__} is not a message")
    try:
        body = msgspec.msgpack.encode(message, enc_hook=describe)
    except (msgspec.MsgspecError, OverflowError, UnicodeEncodeError) as error:
        raise InvalidInput(f"{type(message).__name__} can't be sent: {error}") from error
    _require_caps(body, arrays, limits)
    return Payload(number=number, body=body, arrays=tuple(arrays))


def seal(payload: Payload, header: RequestHeader | ReplyHeader, version: int = PROTOCOL_VERSION) -> list[Part]:
    """The parts to send: prelude, header and payload."""
    prelude = _PRELUDE.pack(version, payload.number)
    return [prelude, msgspec.msgpack.encode(header), payload.body, *payload.arrays]


def open_envelope(parts: Sequence[Part], limits: Limits) -> Envelope:
    """Take a multipart frame apart, and check its sizes only.

    Raises:
        MalformedMessage: it has too few parts, or its first part is not a prelude.
        LimitExceeded: it has too many parts, or too large ones.
    """
    if len(parts) < 3:
        raise MalformedMessage(f"a message has at least 3 parts, {len(parts)} came")
    prelude, header, body, *arrays = parts
    if len(prelude) != _PRELUDE.size:
        raise MalformedMessage(f"the first part has {_PRELUDE.size} bytes, {len(prelude)} came")
    if len(header) > limits.header_bytes:
        raise LimitExceeded(f"a header of {len(header)} bytes came, {limits.header_bytes} are taken")
    _require_caps(body, arrays, limits)
    version, number = _PRELUDE.unpack(prelude)
    return Envelope(version=version, number=number, header=header, body=body, arrays=tuple(arrays))


def decode_header(header: Part, kind: type[HeaderT]) -> HeaderT:
    """Decode a header.

    Raises:
        MalformedMessage: it is not a header of that kind.
    """
    try:
        return msgspec.msgpack.decode(header, type=kind)
    except UNDECODABLE as error:
        raise MalformedMessage(f"{kind.__name__}: {error}") from error


def decode(envelope: Envelope, limits: Limits) -> Message:
    """Decode the message in an envelope; its arrays are read-only views of the received parts.

    Raises:
        VersionMismatch: it has a version that this side does not speak.
        ImpossibleValue: a value in it is out of its field's bounds; the error names the field.
        MalformedMessage: it can't be decoded for any other reason.
    """
    kind = message_type(envelope.number)
    _require_version(envelope.version, kind)
    arrays = ArrayParts(envelope.arrays, limits)
    try:
        message = msgspec.msgpack.decode(envelope.body, type=kind, dec_hook=arrays.take)
        arrays.require_all_taken()
    except (*UNDECODABLE, ValueError) as error:
        broken = ImpossibleValue if _is_out_of_bounds(error) else MalformedMessage
        raise broken(f"{kind.__name__}: {error}") from error
    return message


def _is_out_of_bounds(error: Exception) -> bool:
    """Whether the message could be decoded, and breaks a bound of a type or a rule of a struct."""
    if not isinstance(error, msgspec.ValidationError):
        return False
    if isinstance(error.__cause__, ValueError):
        return not isinstance(error.__cause__, WrongArray)
    return _OUT_OF_BOUNDS.match(str(error)) is not None


def _require_version(version: int, kind: MessageType) -> None:
    if kind not in _EVERY_VERSION and not OLDEST_PROTOCOL_VERSION <= version <= PROTOCOL_VERSION:
        raise VersionMismatch(
            f"{kind.__name__} came in version {version} of the protocol; "
            f"this side speaks {OLDEST_PROTOCOL_VERSION} to {PROTOCOL_VERSION}"
        )


def _require_caps(body: Part, arrays: Sequence[Part], limits: Limits) -> None:
    if len(arrays) > limits.arrays:
        raise LimitExceeded(f"a message with {len(arrays)} arrays; {limits.arrays} are allowed")
    if len(body) > limits.body_bytes:
        raise LimitExceeded(f"a body of {len(body)} bytes; {limits.body_bytes} are allowed")
    sizes = list(map(len, arrays))
    for size in sizes:
        if size > limits.array_bytes:
            raise LimitExceeded(f"an array of {size} bytes; {limits.array_bytes} are allowed")
    total = len(body) + sum(sizes)
    if total > limits.message_bytes:
        raise LimitExceeded(f"a message of {total} bytes; {limits.message_bytes} are allowed")
