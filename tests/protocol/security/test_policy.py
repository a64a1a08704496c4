"""An address that other machines can reach needs a key, or an explicit `insecure`."""

import argparse

import pytest

from protocol.errors import AddressUnavailable, InvalidInput, NotPermitted
from protocol.messages import Role
from protocol.security import LOCAL_ONLY, Security, is_local
from protocol.security.options import add_security_options, security_of

BEYOND = [
    "tcp://0.0.0.0:1",
    "tcp://*:1",
    "tcp://10.0.0.7:1",
    "tcp://gpu-box:1",
    "tcp://[::]:1",
    "tcp://[fe80::1]:1",
]
WITHIN = ["ipc:///run/worker", "tcp://127.0.0.1:1", "tcp://127.9.9.9:1", "tcp://localhost:1", "tcp://[::1]:1"]


@pytest.mark.parametrize("address", WITHIN)
def test_within_the_machine_no_key_is_needed(address):
    assert is_local(address)
    assert LOCAL_ONLY.credentials_for(address) is None
    assert LOCAL_ONLY.curve_to(address, Role.RENDER) is None


@pytest.mark.parametrize("address", BEYOND)
def test_beyond_it_the_refusal_says_what_to_do(address):
    assert not is_local(address)
    with pytest.raises(NotPermitted, match=r"orchestrator keys new.*--key.*--insecure"):
        LOCAL_ONLY.credentials_for(address)


@pytest.mark.parametrize("address", [*BEYOND, *WITHIN])
def test_insecure_means_no_keys_anywhere(address):
    assert Security(insecure=True).credentials_for(address) is None


def test_who_has_keys_uses_them_on_every_tcp_socket(deployment):
    security = deployment.security("agent")
    assert all(security.credentials_for(address) for address in (*BEYOND, *WITHIN[1:]))
    assert security.credentials_for("ipc:///run/worker") is None


def test_what_is_no_address_is_told_before_anything_about_keys():
    with pytest.raises(AddressUnavailable):
        LOCAL_ONLY.credentials_for("nowhere")


def options(*words):
    parser = argparse.ArgumentParser()
    add_security_options(parser)
    return parser.parse_args(words)


def test_without_options_there_are_no_keys():
    assert security_of(options(), {}) == LOCAL_ONLY


def test_the_key_may_be_named_by_the_environment(deployment):
    environment = {"VANTAGE_KEY": str(deployment.folder / "agent.key")}
    found = security_of(options(), environment)
    assert found.credentials is not None
    assert found.credentials.own.name == "agent"
    assert security_of(options("--insecure"), environment) == Security(insecure=True)


def test_keys_and_none_at_once_are_refused(deployment):
    with pytest.raises(InvalidInput, match="leave out"):
        security_of(options("--insecure", "--key", str(deployment.folder / "agent.key")), {})


def test_a_list_without_a_key_is_refused():
    with pytest.raises(InvalidInput, match="--allowed"):
        security_of(options("--allowed", "x"), {})


def test_a_key_of_another_role_than_is_needed_is_refused_and_none_at_all_is_not(deployment):
    security = deployment.security("render")
    security.require_role(Role.RENDER)
    LOCAL_ONLY.require_role(Role.AGENT)
    with pytest.raises(
        NotPermitted, match="'render' is of the role render, and this process needs one of the role agent"
    ):
        security.require_role(Role.AGENT)
