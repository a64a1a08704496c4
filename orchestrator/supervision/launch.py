"""How each process of a run is started: its name, its command line, where it serves."""

import sys
from collections.abc import Sequence
from pathlib import Path

from msgspec import Struct

from protocol.config import RunConfig
from protocol.messages import Role

TRAINING, EVALUATION = "agent", "evaluation"
"""What the two agents are called."""
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


def registry_address(sockets: Path) -> str:
    """Where the orchestrator answers the processes that it started."""
    return f"ipc://{sockets}/orchestrator"


def worker_launches(config: RunConfig, config_path: Path, sockets: Path) -> tuple[Launch, ...]:
    """The render and perception workers of a run; every perception worker may ask every render worker.

    Args:
        sockets: a directory with a short path, for the `ipc://` sockets.
    """
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
        workers: those that it is told of; of others it learns from the orchestrator.
        options: of its command line, besides.
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
    """Where the workers (of one role) serve."""
    return tuple(worker.address for worker in workers if worker.address and role in (None, worker.role))


def module_command(module: str, *arguments: str) -> tuple[str, ...]:
    """This interpreter on one of our modules."""
    # Safe path: a folder named `agent` where the user happens to stand must not hide ours.
    return sys.executable, "-P", "-m", module, *arguments


def _worker(name: str, role: Role, module: str, sockets: Path, options: tuple[str, ...]) -> Launch:
    address = f"ipc://{sockets}/{name}"
    command = module_command(module, "--bind", address, *_registration(name, sockets), *options)
    return Launch(name=name, role=role, command=command, address=address)


def _agent(activity: str, name: str, run: Path, workers: Sequence[Launch], sockets: Path) -> tuple[str, ...]:
    # Absolute: the same run gives the same command wherever the orchestrator is called, so that it finds the process.
    return (
        *module_command("agent", activity, "--run", str(run.resolve()), *_registration(name, sockets)),
        *_repeated("--render", addresses(workers, Role.RENDER)),
        *_repeated("--perception", addresses(workers, Role.PERCEPTION)),
    )


def _registration(name: str, sockets: Path) -> tuple[str, ...]:
    """How a process joins the run, and learns that its orchestrator is gone."""
    return "--orchestrator", registry_address(sockets), "--name", name


def _repeated(option: str, values: Sequence[str]) -> tuple[str, ...]:
    return tuple(word for value in values for word in (option, value))
