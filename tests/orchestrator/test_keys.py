"""`orchestrator keys`: what it makes, lists and revokes is what processes go by."""

import json

import pytest
from typer.testing import CliRunner

from orchestrator.cli.app import app
from protocol.errors import NotPermitted
from protocol.messages import Role
from protocol.security import load_credentials


@pytest.fixture
def keys(monkeypatch, tmp_path):
    """Calls the command in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, ["keys", *arguments])


def test_a_new_key_is_one_that_a_process_can_use(keys, tmp_path):
    done = keys("new", "gpu-box", "--role", "render")
    assert (done.exit_code, done.stdout.strip()) == (0, "keys/gpu-box.key")
    own = load_credentials(tmp_path / "keys" / "gpu-box.key").own
    assert (own.name, own.role) == ("gpu-box", Role.RENDER)


def test_a_revoked_key_is_one_that_no_process_starts_with(keys, tmp_path):
    keys("new", "gpu-box", "--role", "render")
    assert keys("revoke", "gpu-box").exit_code == 0
    with pytest.raises(NotPermitted, match="was revoked"):
        load_credentials(tmp_path / "keys" / "gpu-box.key")


def test_the_list_names_every_key_and_says_which_count(keys):
    keys("new", "gpu-box", "--role", "render")
    keys("new", "trainer", "--role", "agent")
    keys("revoke", "gpu-box")
    listed = json.loads(keys("list", "--json").stdout)
    assert [(key["name"], key["role"], key["revoked"]) for key in listed] == [
        ("gpu-box", "render", True),
        ("trainer", "agent", False),
    ]
    table = keys("list").stdout
    assert "revoked" in table
    assert "allowed" in table


def test_nothing_secret_is_ever_printed(keys, tmp_path):
    printed = keys("new", "gpu-box", "--role", "render").output
    secret = json.loads((tmp_path / "keys" / "gpu-box.key").read_text())["secret"]
    printed += keys("list").output + keys("list", "--json").output + keys("new", "gpu-box", "--role", "render").output
    assert secret not in printed


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("list",), "there are no keys in keys"),
        (("revoke", "nobody"), "can't read the list"),
        (("new", "a/b", "--role", "render"), "is not a name for a key"),
        (("new", "x", "--role", "king"), "king"),
        (("new", "x"), "--role"),
    ],
)
def test_what_can_t_be_done_is_said_and_leaves_nothing(keys, tmp_path, arguments, sentence):
    done = keys(*arguments)
    assert done.exit_code in (1, 2)
    assert sentence in done.output
    assert not (tmp_path / "keys").exists()


def test_a_name_is_given_once(keys, tmp_path):
    keys("new", "gpu-box", "--role", "render")
    before = {path.name: path.read_bytes() for path in (tmp_path / "keys").iterdir()}
    done = keys("new", "gpu-box", "--role", "agent")
    assert done.exit_code == 2
    assert "already" in done.output
    assert {path.name: path.read_bytes() for path in (tmp_path / "keys").iterdir()} == before
