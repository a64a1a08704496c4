"""A key is drawn, kept where only its owner reads it, and used only if it is whole."""

import json
import stat

import pytest

from protocol.errors import InvalidInput, NotPermitted
from protocol.messages import Role
from protocol.security import new_key_pair, read_key, write_key


@pytest.fixture
def path(tmp_path):
    return tmp_path / "keys" / "gpu-box.key"


@pytest.fixture
def key(path):
    key = new_key_pair("gpu-box", Role.RENDER)
    write_key(key, path)
    return key


def test_a_key_comes_back_as_it_was_written(key, path):
    assert read_key(path) == key


def test_no_two_keys_are_the_same():
    keys = [new_key_pair("same", Role.AGENT) for _ in range(20)]
    assert len({key.secret for key in keys}) == len({key.public for key in keys}) == 20


def test_only_its_owner_can_read_a_key(key, path):
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_key_that_others_can_read_is_not_used(key, path):
    path.chmod(0o640)
    with pytest.raises(NotPermitted, match=r"others on this machine can read .*chmod 600"):
        read_key(path)


def test_a_key_is_never_overwritten(key, path):
    with pytest.raises(InvalidInput, match="there already"):
        write_key(new_key_pair("gpu-box", Role.RENDER), path)
    assert read_key(path) == key


def test_a_key_is_shown_without_its_secret(key):
    assert key.secret not in repr(key)
    assert key.secret not in f"{key}"


@pytest.mark.parametrize("name", ["", "../up", "a b", "-dash", "x" * 65, "new\nline"])
def test_what_is_no_name_names_no_key(name):
    with pytest.raises(InvalidInput, match="not a name for a key"):
        new_key_pair(name, Role.RENDER)


def test_a_key_that_is_not_there_is_told_with_how_to_make_one(path):
    with pytest.raises(NotPermitted, match=r"No such file.*orchestrator keys new"):
        read_key(path)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("secret", new_key_pair("other", Role.RENDER).secret),
        ("public", new_key_pair("other", Role.RENDER).public),
        ("secret", "~" * 40),
    ],
    ids=["another's secret", "another's public half", "no secret at all"],
)
def test_a_key_whose_halves_don_t_fit_is_damaged(key, path, field, value):
    path.write_text(json.dumps(json.loads(path.read_text()) | {field: value}))
    with pytest.raises(NotPermitted, match="damaged"):
        read_key(path)


@pytest.mark.parametrize(
    "content", [b"", b"{", b"\xff\xfe", b"[]", b'{"name": "x"}', b'{"name": "x", "role": "king"}', b"ssh-ed25519 AAAA"]
)
def test_a_file_that_is_no_key_is_refused_by_name(key, path, content):
    path.write_bytes(content)
    with pytest.raises(NotPermitted, match=r"gpu-box\.key is not a key"):
        read_key(path)
