"""Workers for the agent to talk to: analytic ones in threads of this process, real ones as processes of their own."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from agent.connections import Workers
from protocol.messages import Observe, Role, Sampled, SampleScene
from tests.agent.analytic_eyes import AnalyticEyes, observe
from tests.serving import serving


@contextmanager
def analytic_workers(sockets: Path) -> Iterator[Workers]:
    """Real sockets, no pictures."""
    eyes = AnalyticEyes()
    render, perception = f"ipc://{sockets}/render", f"ipc://{sockets}/perception"
    scenes = {SampleScene: lambda asked: Sampled(scene=eyes.sample(asked.seed, asked.split))}
    sights = {Observe: lambda asked: observe(asked.scene, asked.camera, asked.filter)}
    with serving(scenes, render, role=Role.RENDER), serving(sights, perception, role=Role.PERCEPTION):
        yield Workers(render=(render,), perception=(perception,))


@contextmanager
def real_workers(sockets: Path) -> Iterator[Workers]:
    """The render and the perception worker."""
    render, perception = f"ipc://{sockets}/render", f"ipc://{sockets}/perception"
    with ExitStack() as running:
        running.enter_context(_process("render_worker", "--bind", render))
        running.enter_context(_process("perception_worker", "--bind", perception, "--render", render))
        yield Workers(render=(render,), perception=(perception,))


def agent_command(job: str, run: Path, workers: Workers, *options: str) -> list[str]:
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
