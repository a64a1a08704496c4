"""Only a caller that knows the token may end a process."""

import os

import pytest

from protocol.errors import NotPermitted
from protocol.telemetry.control import TOKEN_VARIABLE, is_same, token_from

TOKEN = "0123456789abcdef0123456789abcdef"


@pytest.fixture
def file(tmp_path):
    def write(content: bytes, mode: int = 0o600):
        path = tmp_path / "token"
        path.write_bytes(content)
        path.chmod(mode)
        return path

    return write


def test_without_a_file_there_is_none():
    assert token_from(None, {}) == ""


def test_it_is_what_the_file_holds_that_is_named(file):
    path = file(f"{TOKEN}\n".encode())
    assert token_from(path, {}) == TOKEN
    assert token_from(None, {TOKEN_VARIABLE: str(path)}) == TOKEN


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "holds no token"),
        (b"short\n", "16 characters or more"),
        (b"with spaces in between them", "without a space"),
        ("ein Schlüsselwort, lang".encode(), "other characters than ASCII"),
    ],
)
def test_what_is_no_token_is_refused_and_not_repeated(file, content, words):
    with pytest.raises(NotPermitted, match=words) as caught:
        token_from(file(content), {})
    assert content.decode().strip() == "" or content.decode().strip() not in str(caught.value)


def test_a_file_that_others_can_read_is_refused(file):
    with pytest.raises(NotPermitted, match="others on this machine can read the token"):
        token_from(file(TOKEN.encode(), 0o644), {})


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(NotPermitted, match=f"can't read the token {tmp_path}{os.sep}none"):
        token_from(tmp_path / "none", {})


def test_only_the_same_is_the_same():
    assert is_same(TOKEN, TOKEN)
    for other in ("", TOKEN[:-1], TOKEN + "0", "f" + TOKEN[1:], "\xfc"):
        assert not is_same(other, TOKEN)
