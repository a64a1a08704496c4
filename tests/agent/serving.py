"""Workers for the agent to talk to: analytic ones in threads of this process, real ones as processes of their own."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from agent.connections import WorkerAccess
from protocol.messages import Observe, Role, Sampled, SampleScene
from tests.agent.analytic_sensor import AnalyticSensor, observe
from tests.serving import serving


@contextmanager
def analytic_workers(sockets: Path) -> Iterator[WorkerAccess]:
    """Real sockets, no pictures."""
    sensor = AnalyticSensor()
    render, perception = f"ipc://{sockets}/render", f"ipc://{sockets}/perception"
    scenes = {SampleScene: lambda asked: Sampled(scene=sensor.sample(asked.seed, asked.split))}
    sights = {Observe: lambda asked: observe(asked.scene, asked.camera, asked.filter)}
    with serving(scenes, render, role=Role.RENDER), serving(sights, perception, role=Role.PERCEPTION):
        yield WorkerAccess(render=(render,), perception=(perception,))


@contextmanager
def real_workers(sockets: Path) -> Iterator[WorkerAccess]:
    """The render and the perception worker."""
    render, perception = f"ipc://{sockets}/render", f"ipc://{sockets}/perception"
    with ExitStack() as running:
        running.enter_context(_process("render_worker", "--bind", render))
        running.enter_context(_process("perception_worker", "--bind", perception, "--render", render))
        yield WorkerAccess(render=(render,), perception=(perception,))


def agent_command(job: str, run: Path, workers: WorkerAccess, *options: str) -> list[str]:
    """As the orchestrator starts an agent."""
    addresses = ["--render", *workers.render, "--perception", *workers.perception]
    return [sys.executable, "-P", "-m", "agent", job, "--run", str(run), *addresses, *options]


def environment() -> dict[str, str]:
    """One thread for every library, as in a run."""
    return {**os.environ, "OMP_NUM_THREADS": "1"}


@contextmanager
def _process(module: str, *arguments: str) -> Iterator[None]:
    process = subprocess.Popen([sys.executable, "-P", "-m", module, *arguments], env=environment())
    try:
        yield
    finally:
        process.terminate()
        process.wait(30)
