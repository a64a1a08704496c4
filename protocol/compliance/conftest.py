"""Connections to the worker under test, and in which order its rules are tried."""

from collections.abc import Generator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zmq

from protocol.compliance.wire import Connect, Wire, connected
from protocol.compliance.work import ROLES, SCENE, PerceptionWork, RenderWork, Work
from protocol.errors import CallFailed, ProtocolError
from protocol.messages import Hello, Role, Sampled, SampleScene, State, Welcome
from protocol.timeouts import DEFAULT_TIMEOUTS
from protocol.transport.sockets import Context

_HERE = Path(__file__).parent
_LAST = ("test_afterwards.py", "test_drain.py")
"""The files of tests that only make sense after all others, or end the worker."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Sort the rules, and require the address of a worker."""
    rules = [item for item in items if item.path.parent == _HERE]
    if rules and config.option.worker is None and not config.option.collectonly:
        raise pytest.UsageError("the compliance suite tests a worker; name its address: --worker tcp://host:port")
    items.sort(key=lambda item: _LAST.index(item.path.name) + 1 if item in rules and item.path.name in _LAST else 0)
    for item in rules:
        if item.path.name == "test_drain.py" and not config.option.drain:
            item.add_marker(pytest.mark.skip(reason="it ends the worker; ask for it with --drain"))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the rule to the report of each failure."""
    report = yield
    rule = getattr(getattr(item, "obj", None), "__doc__", None)
    if report.failed and rule:
        report.sections.append(("The rule", rule))
    return report


@pytest.fixture(scope="session")
def context() -> Generator[Context]:
    """All connections' ZeroMQ context."""
    with zmq.Context[zmq.Socket[bytes]]() as context:
        yield context


@pytest.fixture
def connect(request: pytest.FixtureRequest, context: Context) -> Generator[Connect]:
    """Opens connections, each of which is closed when the test ends."""
    option = request.config.option
    with ExitStack() as opened:
        yield lambda: opened.enter_context(connected(context, option.worker, option.patience))


@pytest.fixture
def wire(connect: Connect) -> Wire:
    """One connection."""
    return connect()


@pytest.fixture(scope="session")
def first_wire(request: pytest.FixtureRequest, context: Context) -> Generator[Wire]:
    """The connection that lasts from before the first test until after the last."""
    option = request.config.option
    with connected(context, option.worker, option.patience) as wire:
        yield wire


@pytest.fixture(scope="session")
def welcome(request: pytest.FixtureRequest, first_wire: Wire) -> Welcome:
    """The worker's first answer to `Hello`, once the worker is ready. Without it no rule can be tested."""
    try:
        welcome = first_wire.call(Hello(role=Role.AGENT, incarnation="compliance"))
        first_wire.wait_until(lambda pong: pong.state is not State.STARTING, seconds=DEFAULT_TIMEOUTS.startup)
    except (CallFailed, ProtocolError) as error:
        pytest.exit(
            f"no worker to test at {request.config.option.worker}: {error}", returncode=pytest.ExitCode.USAGE_ERROR
        )
    if not isinstance(welcome, Welcome) or welcome.role not in ROLES:
        pytest.exit(
            f"the suite has no requests for a worker of this role: {welcome}", returncode=pytest.ExitCode.USAGE_ERROR
        )
    return welcome


@pytest.fixture(scope="session")
def work(welcome: Welcome, first_wire: Wire) -> Work:
    """The requests for this worker's role."""
    if welcome.role is Role.PERCEPTION:
        return PerceptionWork()
    sampled = first_wire.call(SampleScene(seed=0, split="train"))
    # A worker without scenes of its own may still draw the suite's; that it must answer `SampleScene` is another rule.
    return RenderWork(sampled.scene if isinstance(sampled, Sampled) else SCENE)


@pytest.fixture(autouse=True)
def still_there(request: pytest.FixtureRequest, welcome: Welcome, connect: Connect) -> Generator[None]:
    """End the session after a test that ended the worker: all later tests would fail for the same reason."""
    session, failed_before = request.session, request.session.testsfailed
    yield
    try:
        connect().ping()
    except (CallFailed, ProtocolError) as error:
        session.shouldfail = f"the worker answers no more after {request.node.name}: {error}"
        if session.testsfailed == failed_before:
            pytest.fail(session.shouldfail, pytrace=False)
