"""The time that the death of a worker adds to a step, with another worker of its role running and without.

    python -m benchmarks.recovery

Flies scripted steps of all drones, kills a worker right after the requests of a step have gone out, and compares how
long that step takes with those around it. Prints a Markdown table.
"""

import argparse
import os
import signal
import statistics
import threading
import time
from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace
from rich.console import Console

from agent.environment.sensor import RemoteSensor
from agent.environment.vector_hover import VectorHover
from agent.learning.policies import scripted
from benchmarks.machine import machine_kind
from orchestrator.monitoring.live_display import Display, open_display
from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.socket_directory import socket_directory
from orchestrator.session import Session
from orchestrator.supervision.fleet import Fleet
from orchestrator.supervision.launch import Launch, addresses, registry_address, worker_launches
from orchestrator.supervision.registry import Registry, serve_registry
from orchestrator.supervision.supervisor import Supervisor
from protocol.client.pool import Pool
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.messages import Role
from protocol.system.stop_request import StopRequest, stop_on_signals
from protocol.timeouts import Timeouts

POLL = 0.02
CALM_STEPS = 8
"""Steps before each death by which the usual time is known."""
WINDOW = 1.0
"""Seconds of the restart budget: each of these deaths is a first one, after which a worker is started again at once."""


class Deaths(Struct, frozen=True):
    """Seconds: of usual steps, of each step with a death in it, and from each death until its successor was ready."""

    usual: list[float]
    struck: list[float]
    startup: list[float]


class Supervised:
    """Workers under supervision, in a thread of its own."""

    def __init__(self, fleet: Fleet, supervisor: Supervisor) -> None:
        self._fleet = fleet
        self._supervisor = supervisor
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._poll, name="supervisor")

    def __enter__(self) -> "Supervised":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def kill(self, name: str) -> int:
        """Kill a worker; returns its process id."""
        pid = self._pid(name)
        os.kill(pid, signal.SIGKILL)
        return pid

    def is_replaced(self, name: str, pid: int) -> bool:
        """Whether a process other than `pid` is ready under the name."""
        return self._pid(name) != pid and self._supervisor.is_ready(name)

    def _pid(self, name: str) -> int:
        return next(process.pid for process in self._fleet.processes if process.name == name)

    def _poll(self) -> None:
        while not self._over.wait(POLL):
            self._supervisor.poll()


@contextmanager
def supervised_workers(
    config: RunConfig, display: Display, stop: StopRequest
) -> Generator[tuple[Supervised, VectorHover]]:
    """Supervised workers, all ready, and an environment that looks through them."""
    timeouts = Timeouts.from_config(config.timeouts)
    with ExitStack() as stack:
        sockets = stack.enter_context(socket_directory())
        stack.enter_context(serve_registry(Registry(timeouts.liveness), registry_address(sockets), timeouts))
        fleet = stack.enter_context(Fleet(sockets / "logs", stop))
        supervisor = stack.enter_context(Supervisor(fleet, config.supervision, timeouts))
        config_path = sockets / "config.toml"
        config_path.write_bytes(resolved_toml(config))
        workers = worker_launches(config, config_path, sockets)
        Session(fleet, supervisor, display, stop).start_workers(workers)
        supervised = stack.enter_context(Supervised(fleet, supervisor))
        render, perception = (
            stack.enter_context(_pool(workers, role, timeouts)) for role in (Role.RENDER, Role.PERCEPTION)
        )
        yield supervised, VectorHover(RemoteSensor(render, perception), config=config.environment)


def _pool(workers: Sequence[Launch], role: Role, timeouts: Timeouts) -> Pool:
    pool = Pool(addresses(workers, role), role=Role.AGENT, serves=role, timeouts=timeouts)
    pool.wait_ready()
    return pool


def die(workers: Supervised, env: VectorHover, victim: str, deaths: int, stop: StopRequest) -> Deaths:
    """Let a worker die so often, each time when its successor has come to work."""
    found = Deaths([], [], [])
    fly = scripted(env.config, noise=1.0)
    env.reset(seed=0)

    def step(strike: bool = False) -> float:
        stop.check()
        begun = time.perf_counter()
        env.send(fly(env.observations, env.flights))
        if strike:
            replaced.append((time.perf_counter(), workers.kill(victim)))
        env.receive()
        return time.perf_counter() - begun

    for _ in range(deaths):
        replaced: list[tuple[float, int]] = []
        found.usual.extend(step() for _ in range(CALM_STEPS))
        found.struck.append(step(strike=True))
        killed, pid = replaced[0]
        while not workers.is_replaced(victim, pid):
            stop.sleep(POLL)
        found.startup.append(time.perf_counter() - killed)
        step()
    return found


def row(name: str, deaths: Deaths) -> str:
    """A row of the table."""
    usual = statistics.median(deaths.usual)
    costs = [struck - usual for struck in deaths.struck]
    figures = (usual, statistics.median(costs), max(costs), statistics.median(deaths.startup), max(deaths.startup))
    return f"| {name} | " + " | ".join(f"{figure:.2f}" for figure in figures) + " |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.recovery", description=__doc__)
    parser.add_argument("--config", type=Path, default=Path("configs/quickstart.toml"))
    parser.add_argument("--deaths", type=int, default=10, help="of each case")
    options = parser.parse_args(arguments)
    config, console = load_config(options.config), Console(soft_wrap=True)
    console.print(f"machine: {machine_kind()}")
    console.print("| death of | usual step, s | more, median | more, worst | startup, median | startup, worst |")
    console.print("|---|---:|---:|---:|---:|---:|")
    with stop_on_signals() as stop, open_display(Console(stderr=True)) as display:
        for role in ("render", "perception"):
            for workers in (2, 1):
                with supervised_workers(_with_workers(config, role, workers), display, stop) as (supervised, env):
                    deaths = die(supervised, env, f"{role}-0", options.deaths, stop)
                name = f"a {role} worker, {'another running' if workers == 2 else 'the only one'}"
                console.print(row(name, deaths), markup=False)


def _with_workers(config: RunConfig, role: str, workers: int) -> RunConfig:
    config = replace(config, supervision=replace(config.supervision, window=WINDOW))
    if role == "render":
        return replace(config, render=replace(config.render, workers=workers))
    return replace(config, perception=replace(config.perception, workers=workers))


if __name__ == "__main__":
    main()
