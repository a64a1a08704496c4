"""Text from outside: files, file names, logs and environment variables may hold bytes that are not UTF-8.

Python represents such a byte in a file name by a lone surrogate, which no encoder takes.
"""

from typing import Any

import msgspec

UNDECODABLE = (msgspec.MsgspecError, UnicodeDecodeError, RecursionError, MemoryError, OverflowError)
"""The errors of decoding bytes that are not such a record: cut off, in another encoding, too deep, or too large."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


class NotUtf8(ValueError):
    """A text is in another encoding; the message continues a sentence that begins with the file's name."""


def utf8_text(encoded: bytes) -> str:
    """Decode a file's text, without the byte-order mark that some editors write.

    Raises:
        NotUtf8: it is in another encoding.
    """
    try:
        text = encoded.removeprefix(_BYTE_ORDER_MARK).decode()
    except UnicodeDecodeError as error:
        raise NotUtf8(f"is not UTF-8 (byte {error.start + 1}); save it as UTF-8 and try again") from error
    if "\0" in text:
        raise NotUtf8("is not UTF-8, by its zeros UTF-16 or UTF-32; save it as UTF-8 and try again")
    return text


def readable(text: str) -> str:
    """The text with a question mark for each byte that is not UTF-8."""
    return text.encode(errors="replace").decode()


def one_line(text: str) -> str:
    """The text with a space for each control character, such as a new line or the beginning of an escape sequence."""
    return "".join(character if character.isprintable() else " " for character in text).strip()


def json_of(value: Any, *, stable: bool = False) -> bytes:
    """A value as JSON, with any bytes in its strings; a value of a type that JSON lacks is written by its `repr`.

    Args:
        stable: whether the fields come in a stable order.
    """
    order = "deterministic" if stable else None
    try:
        return msgspec.json.encode(value, enc_hook=repr, order=order)
    except UnicodeEncodeError:
        plain = msgspec.to_builtins(value, enc_hook=repr, str_keys=True)
        return msgspec.json.encode(_all_readable(plain), order=order)


def _all_readable(value: Any) -> Any:
    """The builtin value with all of its strings readable."""
    if isinstance(value, str):
        return readable(value)
    if isinstance(value, dict):
        return {readable(str(key)): _all_readable(one) for key, one in value.items()}  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    if isinstance(value, list | tuple):
        return [_all_readable(one) for one in value]  # pyright: ignore[reportUnknownVariableType]
    return value
