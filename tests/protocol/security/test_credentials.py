"""Which key a worker has to prove, and whether a process' own key is any good."""

import pytest

from protocol.errors import NotPermitted
from protocol.messages import Role
from protocol.security import load_credentials, new_key_pair, read_key


def test_a_role_s_only_key_is_the_one_to_prove(deployment):
    credentials = load_credentials(deployment.folder / "agent.key")
    assert credentials.server_key(Role.RENDER) == read_key(deployment.folder / "render.key").public


def test_with_several_keys_of_a_role_the_table_has_to_say_which(deployment):
    second = read_key(deployment.make("render-2", Role.RENDER)).public
    credentials = load_credentials(deployment.folder / "agent.key")
    with pytest.raises(NotPermitted, match=r"one of several keys \(render, render-2\)"):
        credentials.server_key(Role.RENDER)
    assert credentials.server_key(Role.RENDER, announced=second) == second


def test_an_announced_key_of_another_role_is_refused(deployment):
    credentials = load_credentials(deployment.folder / "agent.key")
    perception = read_key(deployment.folder / "perception.key").public
    with pytest.raises(NotPermitted, match="that of a perception, not of a render"):
        credentials.server_key(Role.RENDER, announced=perception)


@pytest.mark.parametrize("kind", ["unknown", "revoked"])
def test_an_announced_key_that_does_not_count_is_refused(deployment, kind):
    announced = new_key_pair("x", Role.RENDER).public
    if kind == "revoked":
        announced = read_key(deployment.folder / "render.key").public
        deployment.revoke("render")
    with pytest.raises(NotPermitted, match="not allowed, or was revoked"):
        load_credentials(deployment.folder / "agent.key").server_key(Role.RENDER, announced=announced)


def test_a_role_without_a_key_is_told(deployment):
    deployment.revoke("render")
    with pytest.raises(NotPermitted, match="no key is allowed for the role render"):
        load_credentials(deployment.folder / "agent.key").server_key(Role.RENDER)


def test_a_process_whose_own_key_was_revoked_does_not_start(deployment):
    deployment.revoke("agent")
    with pytest.raises(NotPermitted, match=r"agent\.key .*was revoked"):
        load_credentials(deployment.folder / "agent.key")


def test_a_process_whose_own_key_was_never_allowed_does_not_start(deployment):
    path = deployment.make("new", Role.AGENT, allow=False)
    with pytest.raises(NotPermitted, match="not in the list"):
        load_credentials(path)


def test_the_list_may_lie_elsewhere(deployment, tmp_path):
    elsewhere = tmp_path / "elsewhere.json"
    deployment.allowed.rename(elsewhere)
    assert load_credentials(deployment.folder / "agent.key", elsewhere).own.role is Role.AGENT
