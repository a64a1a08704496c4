"""How each process of a run is started: its name, its command line, where it serves."""

import sys
from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from protocol.config import RunConfig
from protocol.messages import Role

PROCESS_ENVIRONMENT: dict[str, str] = {
    # One thread for every numerical library: processes share the cores, and sums come out in one order.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # A crash in native code leaves its stack in the log.
    "PYTHONFAULTHANDLER": "1",
    "PYTHONUNBUFFERED": "1",
}
"""What every process of a run is given on top of the orchestrator's own environment."""


class Launch(Struct, frozen=True, kw_only=True):
    """One process to start.

    Attributes:
        address: where it will serve; none for the agent, which serves nothing.
    """

    name: str
    role: Role
    command: tuple[str, ...]
    address: str | None = None


class Evaluate(Struct, frozen=True, kw_only=True):
    """What to evaluate of a run; what is None or empty is as its configuration says."""

    episodes: int | None = None
    policies: tuple[str, ...] = ()


def worker_launches(config: RunConfig, config_path: Path, sockets: Path) -> tuple[Launch, ...]:
    """The render and perception workers of a run; every perception worker may ask every render worker.

    Args:
        sockets: a directory with a short path, for the `ipc://` sockets.
    """
    options = ("--config", str(config_path))
    renderers = [
        _worker(f"render-{number}", Role.RENDER, "render_worker", sockets, options)
        for number in range(config.render.workers)
    ]
    options += _repeated("--render", addresses(renderers))
    perceivers = [
        _worker(f"perception-{number}", Role.PERCEPTION, "perception_worker", sockets, options)
        for number in range(config.perception.workers)
    ]
    return *renderers, *perceivers


def training_launch(run: Path, workers: Sequence[Launch]) -> Launch:
    """The agent that trains in the run directory `run`."""
    return Launch(name="agent", role=Role.AGENT, command=_agent("train", run, workers))


def evaluation_launch(run: Path, workers: Sequence[Launch], evaluate: Evaluate) -> Launch:
    """The agent that flies the evaluation of the run directory `run`."""
    command = _agent("evaluate", run, workers) + _repeated("--policy", evaluate.policies)
    if evaluate.episodes is not None:
        command += ("--episodes", str(evaluate.episodes))
    return Launch(name="evaluation", role=Role.AGENT, command=command)


def addresses(workers: Sequence[Launch], role: Role | None = None) -> tuple[str, ...]:
    """Where the workers (of one role) serve."""
    return tuple(worker.address for worker in workers if worker.address and role in (None, worker.role))


def module_command(module: str, *arguments: str) -> tuple[str, ...]:
    """This interpreter on one of our modules."""
    # Safe path: a folder named `agent` where the user happens to stand must not hide ours.
    return sys.executable, "-P", "-m", module, *arguments


def _worker(name: str, role: Role, module: str, sockets: Path, options: tuple[str, ...]) -> Launch:
    address = f"ipc://{sockets}/{name}"
    command = module_command(module, "--bind", address, *options)
    return Launch(name=name, role=role, command=command, address=address)


def _agent(activity: str, run: Path, workers: Sequence[Launch]) -> tuple[str, ...]:
    return (
        *module_command("agent", activity, "--run", str(run)),
        *_repeated("--render", addresses(workers, Role.RENDER)),
        *_repeated("--perception", addresses(workers, Role.PERCEPTION)),
    )


def _repeated(option: str, values: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for value in values for word in (option, value))
