import pytest

from protocol.client.diagnosis import Standing
from protocol.messages import Role, State
from protocol.telemetry.readiness import Readiness, Wait, own_waits, readiness, waits_for_any

HERE = Standing(address="ipc:///a", at_work=True)
GONE = Standing(address="ipc:///b", at_work=False, reason="there is no connection to it")


def test_who_waits_for_nothing_is_ready():
    assert readiness(()) == Readiness(ready=True, waits_for=())
    assert readiness([Wait("start", "x")]) == Readiness(ready=False, waits_for=(Wait("start", "x"),))


@pytest.mark.parametrize(("state", "on"), [("starting", ["start"]), ("ready", []), ("busy", []), ("draining", ["end"])])
def test_a_worker_waits_while_it_starts_and_while_it_ends(state, on):
    assert [wait.on for wait in own_waits(State(state))] == on


@pytest.mark.parametrize("standings", [(HERE,), (GONE, HERE), (HERE, GONE)])
def test_one_worker_of_a_role_is_enough(standings):
    assert waits_for_any(Role.RENDER, standings) == ()


def test_without_any_each_is_named_with_its_reason():
    assert waits_for_any(Role.RENDER, (GONE, GONE)) == (Wait("render", "ipc:///b: there is no connection to it"),) * 2
    assert waits_for_any(Role.PERCEPTION, ()) == (Wait("perception", "none is known"),)
