"""Observes the views of a directory by the workers, with the display and the signals of a command."""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec.structs import replace

from orchestrator.cli.options import at_work, worker_count
from orchestrator.hosting.joining import Join
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT
from protocol.config import Profile, RunConfig
from protocol.config_file import load_config, with_checksums
from protocol.errors import InvalidInput, VantageError

if TYPE_CHECKING:
    from orchestrator.experiments.parts import Parts
    from orchestrator.experiments.views_directory import ViewsDirectory
    from orchestrator.experiments.workers import WorkerPools


def complete(
    directory: "ViewsDirectory[Any]",
    parts: "Parts",
    settings: RunConfig,
    host: Join | None,
    observe: Callable[["WorkerPools"], None],
) -> None:
    """Make the missing parts of a table, and join them.

    Args:
        directory: of the views; no other command may work on it.
        settings: of the workers.
        host: whose workers are used instead of local ones.
        observe: makes the missing parts.
    """
    from orchestrator.experiments.qoe import provenance
    from orchestrator.experiments.workers import experiment_workers

    with directory.lock(), at_work() as (display, stop):
        if parts.is_whole:
            return
        try:
            with experiment_workers(settings, host, display=display, stop=stop) as workers:
                observe(workers)
                versions = collect_versions(PROCESS_ENVIRONMENT)
                parts.join(provenance(settings, directory.views(), versions, workers.capabilities()))
        except VantageError as error:
            error.add_note(
                f"the parts observed so far are kept in {directory.path}: the same command continues from there"
            )
            raise


def worker_settings(
    config: Path | None, workers: int | None, host: Join | None, *, profile: Profile | None = None
) -> RunConfig:
    """The configuration of the workers that observe: a file's, or every default.

    Args:
        workers: perception workers; one for each core if it is left out.
        host: whose workers are used instead of local ones; these have files of their own.
        profile: in place of the file's.

    Raises:
        InvalidConfig: the file is invalid.
    """
    from orchestrator.experiments.workers import with_workers

    told = load_config(config) if config else RunConfig()
    told = told if profile is None else replace(told, profile=profile)
    return with_workers(told if host else with_checksums(told), worker_count(workers))


def require_libraries() -> None:
    """Raise `InvalidInput` if the extra that experiments need is not installed.

    The commands import the experiments' modules: these libraries load slowly, and no other command needs them.
    """
    if lacking := [name for name in ("pyarrow", "scipy", "matplotlib") if importlib.util.find_spec(name) is None]:
        raise InvalidInput(f"experiments need {', '.join(lacking)}; install vantage's extra 'experiments'")
