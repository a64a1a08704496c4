"""The list says which keys are valid, and a change of its file takes effect at once."""

import pytest

from protocol.errors import InvalidInput, NotPermitted
from protocol.messages import Role
from protocol.security import AllowList, AllowListFile, new_key_pair
from protocol.security.allow_list import read_allow_list, write_allow_list


@pytest.fixture
def keys():
    return {role: new_key_pair(role.value, role) for role in Role}


@pytest.fixture
def allowed(keys):
    allowed = AllowList()
    for key in keys.values():
        allowed = allowed.with_key(key)
    return allowed


@pytest.fixture
def path(tmp_path, allowed):
    write_allow_list(allowed, tmp_path / "allowed.json")
    return tmp_path / "allowed.json"


def test_a_key_counts_for_its_own_role_alone(keys, allowed):
    assert {role: allowed.role_of(key.public) for role, key in keys.items()} == {role: role for role in Role}
    assert [key.name for key in allowed.of_role(Role.RENDER)] == ["render"]


def test_a_key_that_is_not_listed_does_not_count(allowed):
    assert allowed.role_of(new_key_pair("x", Role.AGENT).public) is None


def test_a_revoked_key_does_not_count_and_is_still_known(keys, allowed):
    without = allowed.without("agent")
    found = without.find(keys[Role.AGENT].public)
    assert without.role_of(keys[Role.AGENT].public) is None
    assert without.of_role(Role.AGENT) == ()
    assert found is not None
    assert (found.name, found.revoked) == ("agent", True)


def test_a_name_is_given_once_even_after_it_was_revoked(allowed):
    with pytest.raises(InvalidInput, match="already"):
        allowed.without("agent").with_key(new_key_pair("agent", Role.AGENT))


@pytest.mark.parametrize(("name", "message"), [("nobody", "no key 'nobody'"), ("agent", "revoked already")])
def test_what_can_t_be_revoked_is_told(allowed, name, message):
    with pytest.raises(InvalidInput, match=message):
        allowed.without("agent").without(name)


def test_no_secret_is_in_the_list(keys, path):
    text = path.read_text()
    assert all(key.secret not in text and key.public in text for key in keys.values())


def test_a_list_comes_back_as_it_was_written(allowed, path):
    assert read_allow_list(path) == allowed


def test_a_change_is_in_force_at_once(keys, allowed, path):
    file = AllowListFile(path)
    assert file.current().role_of(keys[Role.AGENT].public) is Role.AGENT
    write_allow_list(allowed.without("agent"), path)
    assert file.current().role_of(keys[Role.AGENT].public) is None


@pytest.mark.parametrize("damage", ["removed", "cut off"])
def test_a_list_that_can_t_be_read_any_more_changes_nothing(allowed, path, damage, caplog):
    file = AllowListFile(path)
    if damage == "removed":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:50])
    assert file.current() == allowed
    assert "the keys that were allowed before stay valid" in caplog.text


@pytest.mark.parametrize("content", [b"", b"[]", b'{"format": 2, "keys": []}', b'{"keys": [{"name": "x"}]}', b"\xff"])
def test_what_is_no_list_is_refused_by_name(tmp_path, content):
    path = tmp_path / "allowed.json"
    path.write_bytes(content)
    with pytest.raises(NotPermitted, match=r"allowed\.json is not a list of allowed keys"):
        AllowListFile(path)
