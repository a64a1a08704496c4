"""How each process of a run is started: its name, its command line and its address."""

import sys
from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from protocol.config import RunConfig
from protocol.messages import Role

TRAINING, EVALUATION = "agent", "evaluation"
"""The names of the two agents."""
PROCESS_ENVIRONMENT: dict[str, str] = {
    # One thread for every numerical library: processes share the cores, and sums come out in one order.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    # A crash in native code leaves its stack in the log.
    "PYTHONFAULTHANDLER": "1",
    "PYTHONUNBUFFERED": "1",
}
"""The environment variables that every process of a run gets, besides the orchestrator's own."""


class Launch(Struct, frozen=True, kw_only=True):
    """One process to start.

    Attributes:
        address: where it serves; None for the agent, which serves nothing.
    """

    name: str
    role: Role
    command: tuple[str, ...]
    address: str | None = None


class Evaluate(Struct, frozen=True, kw_only=True):
    """What to evaluate of a run; a value that is None or empty is taken from the configuration."""

    episodes: int | None = None
    policies: tuple[str, ...] = ()


def registry_address(sockets: Path) -> str:
    """The address at which the orchestrator serves the registry to the processes that it starts."""
    return f"ipc://{sockets}/orchestrator"


def worker_launches(config: RunConfig, config_path: Path, sockets: Path) -> tuple[Launch, ...]:
    """The render and perception workers of a run; every perception worker may call every render worker.

    A run on a grid of views that were taken before has none.

    Args:
        sockets: a directory with a short path, for the `ipc://` sockets.
    """
    if config.is_grid:
        return ()
    options = ("--config", str(config_path.resolve()))
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


def training_launch(run: Path, workers: Sequence[Launch], sockets: Path, options: Sequence[str] = ()) -> Launch:
    """The agent that trains in the run directory `run`.

    Args:
        workers: their addresses go on its command line; it learns of others from the orchestrator.
        options: further options of its command line.
    """
    command = (*_agent("train", TRAINING, run, workers, sockets), *options)
    return Launch(name=TRAINING, role=Role.AGENT, command=command)


def evaluation_launch(
    run: Path, workers: Sequence[Launch], sockets: Path, evaluate: Evaluate, options: Sequence[str] = ()
) -> Launch:
    """The agent that flies the evaluation of the run directory `run`; arguments as of `training_launch`."""
    command = (*_agent("evaluate", EVALUATION, run, workers, sockets), *options)
    command += _repeated("--policy", evaluate.policies)
    if evaluate.episodes is not None:
        command += ("--episodes", str(evaluate.episodes))
    return Launch(name=EVALUATION, role=Role.AGENT, command=command)


def addresses(workers: Sequence[Launch], role: Role | None = None) -> tuple[str, ...]:
    """The addresses of the workers, or of those of one role."""
    return tuple(worker.address for worker in workers if worker.address and role in (None, worker.role))


def module_command(module: str, *arguments: str) -> tuple[str, ...]:
    """The command that runs one of our modules in this interpreter."""
    # Safe path: a folder named `agent` in the current directory must not hide ours.
    return sys.executable, "-P", "-m", module, *arguments


def _worker(name: str, role: Role, module: str, sockets: Path, options: tuple[str, ...]) -> Launch:
    address = f"ipc://{sockets}/{name}"
    command = module_command(module, "--bind", address, *_registration(name, sockets), *options)
    return Launch(name=name, role=role, command=command, address=address)


def _agent(activity: str, name: str, run: Path, workers: Sequence[Launch], sockets: Path) -> tuple[str, ...]:
    # Absolute: a run has the same command in any current directory, and so an orchestrator finds its orphans.
    return (
        *module_command("agent", activity, "--run", str(run.resolve()), *_registration(name, sockets)),
        *_repeated("--render", addresses(workers, Role.RENDER)),
        *_repeated("--perception", addresses(workers, Role.PERCEPTION)),
    )


def _registration(name: str, sockets: Path) -> tuple[str, ...]:
    """The options by which a process registers with the run's orchestrator, and learns that it is gone."""
    return "--orchestrator", registry_address(sockets), "--name", name


def _repeated(option: str, values: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for value in values for word in (option, value))
