"""Clients that are open where a process is forked, or that are sent to one that is spawned."""

import multiprocessing
import os
import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import gymnasium
import numpy as np
import pytest

from agent.environment.hover import Hover
from agent.environment.sensor import RemoteSensor
from protocol import Client, Pool
from protocol.errors import ClientClosed, DeadlineExceeded, NotPermitted, VantageError
from protocol.messages import Observe, Role, Sampled, SampleScene
from protocol.timeouts import Timeouts
from tests.agent.analytic_sensor import AnalyticSensor, observe
from tests.protocol.security.deployment import Deployment
from tests.serving import serving

pytestmark = [
    pytest.mark.slow,
    # Newer Pythons warn of what is tried here.
    pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning"),
]

WAYS = ("fork", "spawn", "forkserver")
PATIENCE = 60.0
SENSOR = AnalyticSensor()


def sampled(request: SampleScene) -> Sampled:
    return Sampled(scene=SENSOR.sample(request.seed, request.split))


def ask(client: Client | Pool, seed: int = 7, deadline: float = 30.0) -> Any:
    return client.call(SampleScene(seed=seed, split="train"), deadline=deadline).scene


@pytest.fixture
def sockets(tmp_path_factory):
    return tmp_path_factory.mktemp("s")


@pytest.fixture
def render(sockets):
    address = f"ipc://{sockets}/render"
    with serving({SampleScene: sampled}, address, role=Role.RENDER):
        yield address


@pytest.fixture
def perception(sockets):
    address = f"ipc://{sockets}/perception"
    with serving(
        {Observe: lambda asked: observe(asked.scene, asked.camera, asked.filter)}, address, role=Role.PERCEPTION
    ):
        yield address


@pytest.fixture
def held(sockets):
    """A worker that answers nothing before it is let go."""
    address, go = f"ipc://{sockets}/held", threading.Event()

    def sample(request: SampleScene) -> Sampled:
        go.wait(PATIENCE)
        return sampled(request)

    with serving({SampleScene: sample}, address, role=Role.RENDER):
        yield address
        go.set()


def _outcome(answering, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    try:
        answering.send(work(*arguments))
    except VantageError as error:
        answering.send(error)


def elsewhere(way: str, work: Callable[..., Any], *arguments: Any) -> Any:
    """What work comes to in a process that is started in one of the ways."""
    context = multiprocessing.get_context(way)
    hearing, answering = context.Pipe(duplex=False)
    process = context.Process(target=_outcome, args=(answering, work, arguments))
    process.start()
    answering.close()
    try:
        assert hearing.poll(PATIENCE), "the process waits for ever"
        outcome = hearing.recv()
        process.join(PATIENCE)
        assert process.exitcode == 0
    finally:
        process.kill()
        process.join()
        process.close()
        hearing.close()
    if isinstance(outcome, VantageError):
        raise outcome
    return outcome


@pytest.mark.parametrize("way", WAYS)
def test_a_pool_that_is_open_here_is_open_there_and_stays_open_here(render, way):
    with Pool([render], role=Role.AGENT, serves=Role.RENDER) as pool:
        here = ask(pool)
        assert elsewhere(way, ask, pool) == here
        assert elsewhere(way, ask, pool, 8) == ask(pool, 8)


@pytest.mark.parametrize("way", WAYS)
def test_a_client_that_was_never_used_can_be_used_there(render, way):
    with Client(render, role=Role.AGENT) as client:
        assert elsewhere(way, ask, client) == ask(client)


@pytest.mark.parametrize("way", WAYS)
def test_a_call_that_nobody_answers_ends_by_its_deadline_there_too(held, way):
    with Pool([held], role=Role.AGENT, serves=Role.RENDER) as pool, pytest.raises(DeadlineExceeded):
        elsewhere(way, ask, pool, 7, 0.5)


def test_a_call_that_was_under_way_at_the_fork_ends_at_once_there_and_goes_on_here(held):
    with Pool([held], role=Role.AGENT, serves=Role.RENDER) as pool:
        pending = pool.submit(SampleScene(seed=7, split="train"), deadline=1.0)
        with pytest.raises(ClientClosed, match=f"made in process {os.getpid()}, and this process was forked"):
            elsewhere("fork", pending.result)
        assert elsewhere("fork", pending.done)
        with pytest.raises(DeadlineExceeded):
            pending.result()


def test_a_reply_that_was_there_at_the_fork_is_there(render):
    with Pool([render], role=Role.AGENT, serves=Role.RENDER) as pool:
        pending = pool.submit(SampleScene(seed=7, split="train"))
        assert pending.result().scene == elsewhere("fork", pending.result).scene


def _ask_closed(pool: Pool) -> Any:
    pool.close()
    return ask(pool)


def test_a_pool_that_is_closed_there_stays_open_here(render):
    with Pool([render], role=Role.AGENT, serves=Role.RENDER) as pool:
        with pytest.raises(ClientClosed):
            elsewhere("fork", _ask_closed, pool)
        assert ask(pool)


def test_a_pool_that_was_closed_before_is_closed_there(render):
    pool = Pool([render], role=Role.AGENT, serves=Role.RENDER)
    pool.close()
    with pytest.raises(ClientClosed):
        elsewhere("fork", ask, pool)


def _change(pool: Pool, first: str, second: str) -> Any:
    pool.remove(first)
    pool.add(second)
    return pool.addresses, ask(pool)


def test_workers_may_come_and_go_there_alone(held, render):
    with Pool([held], role=Role.AGENT, serves=Role.RENDER) as pool:
        addresses, scene = elsewhere("fork", _change, pool, held, render)
        assert (addresses, pool.addresses) == ((render,), (held,))
        pool.add(render)
        pool.remove(held)
        assert elsewhere("fork", ask, pool) == scene == ask(pool)


def _fork_on(pool: Pool) -> Any:
    return elsewhere("fork", ask, pool)


def test_a_child_of_a_child_has_its_own_as_well(render):
    with Pool([render], role=Role.AGENT, serves=Role.RENDER) as pool:
        assert elsewhere("fork", _fork_on, pool) == ask(pool)


def test_forks_while_other_threads_call_cost_nobody_anything(render):
    over = threading.Event()
    with Pool([render], role=Role.AGENT, serves=Role.RENDER) as pool:

        def call() -> None:
            while not over.is_set():
                ask(pool)

        threads = [threading.Thread(target=call) for _ in range(3)]
        for thread in threads:
            thread.start()
        try:
            for seed in range(10):
                assert elsewhere("fork", ask, pool, seed) == SENSOR.sample(seed, "train")
        finally:
            over.set()
            for thread in threads:
                thread.join()


def test_a_client_with_a_secret_key_is_in_no_pickle(tmp_path):
    security = Deployment(tmp_path).security("agent")
    with (
        Client("tcp://127.0.0.1:1", role=Role.AGENT, serves=Role.RENDER, security=security) as client,
        pytest.raises(NotPermitted, match="make one there"),
    ):
        elsewhere("spawn", ask, client)


@pytest.mark.parametrize("way", WAYS)
def test_environments_side_by_side_see_with_the_pools_of_the_process_that_made_them(render, perception, way):
    timeouts = Timeouts(call=30.0)
    with (
        Pool([render], role=Role.AGENT, serves=Role.RENDER, timeouts=timeouts) as scenes,
        Pool([perception], role=Role.AGENT, serves=Role.PERCEPTION, timeouts=timeouts) as sights,
    ):
        make = partial(Hover, RemoteSensor(scenes, sights))
        alone = gymnasium.vector.SyncVectorEnv([make, make])
        together = gymnasium.vector.AsyncVectorEnv([make, make], context=way)
        try:
            begun, _ = together.reset(seed=[3, 4], options=None)
            np.testing.assert_array_equal(begun, alone.reset(seed=[3, 4])[0])
            action = np.full((2, 3), 0.25, np.float32)
            for _ in range(3):
                for found, expected in zip(together.step(action)[:4], alone.step(action)[:4], strict=True):
                    np.testing.assert_array_equal(found, expected)
        finally:
            together.close(timeout=PATIENCE)
            alone.close()
