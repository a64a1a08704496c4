"""A worker with keys answers only clients that may call; its log names the others."""

import logging
import socket
from contextlib import suppress

import pytest
import zmq

from protocol import Pool, serve
from protocol.errors import CallFailed, DeadlineExceeded, NotPermitted, Rejected
from protocol.messages import (
    Dismiss,
    Dismissed,
    Drain,
    Hello,
    Lookup,
    Register,
    Registered,
    Role,
    State,
    WorkerRecord,
    Workers,
)
from protocol.security import read_key
from protocol.server.registration_settings import RegistrationSettings
from protocol.telemetry.info import About
from protocol.telemetry.worker import worker_telemetry
from tests.protocol.processes.bare_client import bare_client
from tests.protocol.processes.calls import PATIENT, ask, client_of
from tests.protocol.processes.serving import serving
from tests.protocol.processes.waiting import wait_until
from tests.protocol.security.deployment import HASTY, free_port
from tests.protocol.security.relay import relay
from tests.protocol.telemetry.monitors import free_endpoint, monitoring
from tests.protocol.test_observer import Notes

REGISTRY = {Register: lambda _: Registered(), Lookup: lambda _: Workers(workers=())}


@pytest.fixture(autouse=True)
def _heard(caplog):
    caplog.set_level(logging.WARNING)


def test_who_may_call_is_answered(deployment):
    with deployment.serving() as address:
        for role in (Role.AGENT, Role.PERCEPTION, Role.ORCHESTRATOR):
            with deployment.client(address, role) as client:
                assert client.call(ask(3)).scene.yaw == 3


def test_what_is_said_can_t_be_read_on_the_wire(deployment):
    heard: list[bytes] = []
    with (
        deployment.serving() as address,
        relay(address, heard) as in_between,
        deployment.client(in_between, Role.AGENT) as client,
    ):
        assert client.call(ask(3)).scene.yaw == 3
    assert sum(map(len, heard)) > 500
    assert b"train" not in b"".join(heard)


def test_without_keys_it_could_be_read(address):
    """What the test before listens for is there to be heard."""
    heard: list[bytes] = []
    bind = f"tcp://127.0.0.1:{free_port()}"
    with serving(bind), relay(bind, heard) as in_between, client_of(in_between) as client:
        client.call(ask(3))
    assert b"train" in b"".join(heard)


@pytest.mark.parametrize("role", [Role.AGENT, Role.ORCHESTRATOR, Role.PERCEPTION])
def test_a_key_that_is_not_allowed_gets_no_answer_and_is_told_at_once(deployment, role, caplog):
    with deployment.serving() as address, deployment.client(address, role, deployment.stranger(role)) as client:
        with pytest.raises(NotPermitted, match="does not take our key 'stranger'"):
            client.call(ask(1))
        assert "refused 127.0.0.1" in caplog.text
        assert "not in the list of allowed keys" in caplog.text


def test_a_revoked_key_gets_no_answer_and_is_named(deployment, caplog):
    with deployment.serving() as address:
        security = deployment.security("agent")
        deployment.revoke("agent")
        with deployment.client(address, Role.AGENT, security) as client, pytest.raises(NotPermitted):
            client.call(ask(1))
    assert "its key 'agent' was revoked" in caplog.text


def test_a_key_of_a_role_without_business_there_gets_no_answer(deployment, caplog):
    with (
        deployment.serving() as address,
        deployment.client(address, Role.RENDER) as client,
        pytest.raises(NotPermitted),
    ):
        client.call(ask(1))
    assert "its key 'render' is of the role render, which may not call render" in caplog.text


def test_a_key_that_is_revoked_while_it_is_used_is_refused_from_then_on(deployment, caplog):
    with deployment.serving() as address, deployment.client(address, Role.AGENT) as client:
        assert client.call(ask(1)).scene.yaw == 1
        deployment.revoke("agent")
        with pytest.raises(CallFailed) as caught:
            client.call(ask(2), deadline=5.0)
        assert not isinstance(caught.value, DeadlineExceeded)
    assert "its key was revoked" in caplog.text


@pytest.mark.slow
def test_a_key_that_is_allowed_later_gets_through(deployment):
    with deployment.serving() as address:
        security = deployment.security("agent")
        before = deployment.allowed.read_bytes()
        deployment.revoke("agent")
        with deployment.client(address, Role.AGENT, security) as client:
            with pytest.raises(NotPermitted):
                client.call(ask(1))
            deployment.allowed.write_bytes(before)
            wait_until(lambda: _answers(client))


def test_only_an_orchestrator_drains(deployment):
    with deployment.serving() as address, deployment.client(address, Role.AGENT) as client:
        with pytest.raises(Rejected, match="only an orchestrator may drain") as caught:
            client.call(Drain())
        assert caught.value.code == "not-permitted"
        assert client.call(ask(2)).scene.yaw == 2


@pytest.mark.parametrize("role", Role)
def test_only_a_run_dismisses_workers(deployment, role):
    dismissed: list[Dismiss] = []
    handlers = {**REGISTRY, Dismiss: lambda request: (dismissed.append(request), Dismissed())[1]}
    serving = deployment.serving(handlers, role=Role.ORCHESTRATOR)
    with serving as host, deployment.client(host, role, serves=Role.ORCHESTRATOR) as client:
        if role in (Role.AGENT, Role.ORCHESTRATOR):
            client.call(Dismiss(incarnation="x"))
        else:
            with pytest.raises(Rejected, match="only an agent or an orchestrator may dismiss"):
                client.call(Dismiss(incarnation="x"))
    assert len(dismissed) == (role in (Role.AGENT, Role.ORCHESTRATOR))


def test_what_a_key_does_not_permit_is_told_to_the_observer(deployment):
    notes = Notes()
    with deployment.serving(observer=notes) as address, deployment.client(address, Role.AGENT) as client:
        with pytest.raises(Rejected):
            client.call(Drain())
        wait_until(lambda: notes.requests)
        assert notes.told() == [("Drain", "refused", "not-permitted")]


def test_no_secret_key_is_told_to_monitors(deployment):
    at, about = free_endpoint(), About(role=Role.RENDER, name="render")
    secret = read_key(deployment.folder / "render.key").secret
    with (
        worker_telemetry(at, about) as observer,
        deployment.serving(observer=observer) as address,
        deployment.client(address, Role.AGENT) as client,
        monitoring(at) as monitor,
    ):
        client.call(ask(1))
        for path in ("/info", "/metrics", "/health/ready", "/health/live"):
            assert secret not in monitor.get(path).text


def test_nobody_says_hello_as_somebody_else(deployment):
    agent = deployment.security("agent")
    with (
        deployment.serving() as address,
        deployment.client(address, Role.ORCHESTRATOR, agent) as client,
        pytest.raises(Rejected, match="a key of the role agent can't say Hello as orchestrator"),
    ):
        client.call(ask(1))


def test_a_render_worker_s_key_registers_no_agent(deployment):
    record = WorkerRecord(role=Role.AGENT, address="", incarnation="x", state=State.READY)
    serving = deployment.serving(REGISTRY, role=Role.ORCHESTRATOR)
    with serving as address, deployment.client(address, Role.RENDER, serves=Role.ORCHESTRATOR) as client:
        with pytest.raises(Rejected, match="can't register a agent process") as caught:
            client.call(Register(worker=record))
        assert caught.value.code == "not-permitted"


def test_a_stranger_without_a_key_gets_nothing_and_is_noticed(deployment, caplog):
    with deployment.serving() as address:
        with bare_client(address) as bare:
            bare.ask(Hello(role=Role.AGENT, incarnation="x"))
            wait_until(lambda: "before it had shown a valid key" in caplog.text)
            assert not bare.has_reply(0.2)
        with deployment.client(address, Role.AGENT) as client:
            assert client.call(ask(2)).scene.yaw == 2


@pytest.mark.parametrize(
    "words", [b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"\0" * 500, b"\xff" + b"\0" * 8 + b"\x7f" * 200]
)
def test_bare_bytes_get_nothing_and_are_noticed(deployment, caplog, words):
    with deployment.serving() as address:
        host, port = address.removeprefix("tcp://").split(":")
        with socket.create_connection((host, int(port))) as connection, suppress(OSError):
            connection.sendall(words * 20)
        wait_until(lambda: "refused" in caplog.text)
        with deployment.client(address, Role.AGENT) as client:
            assert client.call(ask(2)).scene.yaw == 2


@pytest.mark.slow
def test_a_worker_that_does_not_prove_the_right_key_gets_no_calls(deployment):
    own = read_key(deployment.folder / "perception.key")
    with zmq.Context() as context, context.socket(zmq.ROUTER) as impostor:
        impostor.curve_server = True
        impostor.curve_publickey, impostor.curve_secretkey = own.public.encode(), own.secret.encode()
        address = f"tcp://127.0.0.1:{impostor.bind_to_random_port('tcp://127.0.0.1')}"
        with deployment.client(address, Role.AGENT, timeouts=HASTY) as client, pytest.raises(DeadlineExceeded):
            client.call(ask(1))
        assert not impostor.poll(0)


def test_a_pool_is_told_each_worker_s_key(deployment):
    deployment.make("render-2", Role.RENDER)
    with deployment.serving() as first, deployment.serving(key="render-2") as second:
        security = deployment.security("agent")
        with Pool([], role=Role.AGENT, serves=Role.RENDER, timeouts=PATIENT, security=security) as pool:
            pool.add(first, deployment.public("render"))
            pool.add(second, deployment.public("render-2"))
            assert {pong.state for pong in pool.ping()} <= {State.READY, State.BUSY}
            with pytest.raises(NotPermitted):
                pool.add("tcp://127.0.0.1:1", deployment.public("perception"))
            assert pool.addresses == (first, second)


def test_the_table_tells_a_worker_s_key_and_where_it_is_reached(deployment):
    seen: list[WorkerRecord] = []
    handlers = {Register: lambda request: (seen.append(request.worker), Registered())[1], Lookup: REGISTRY[Lookup]}
    with deployment.serving(handlers, role=Role.ORCHESTRATOR) as registry:
        registration = RegistrationSettings(registry, "gpu-box", advertised="tcp://gpu-box:5601")
        with deployment.serving(registration=registration):
            wait_until(lambda: seen)
    assert seen[0].address == "tcp://gpu-box:5601"
    assert seen[0].key == deployment.public("render")


def test_a_public_address_without_keys_is_refused_before_anything_is_loaded():
    with pytest.raises(NotPermitted, match="keys new"):
        serve(lambda: pytest.fail("it was loaded"), role=Role.RENDER, bind="tcp://0.0.0.0:5601")


def _answers(client) -> bool:
    try:
        return client.call(ask(5), deadline=2.0).scene.yaw == 5
    except (NotPermitted, CallFailed):
        return False
