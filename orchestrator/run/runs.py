"""The runs of a folder: where a new one goes, and which is the newest."""

from datetime import datetime
from pathlib import Path

from orchestrator.errors import NoSuchRun
from orchestrator.run.run_directory import RunDirectory
from protocol.errors import DamagedRecord

RUNS = Path("runs")
_TIME = "%Y%m%d-%H%M%S"


def default_run_path(config_path: Path, now: datetime) -> Path:
    """`runs/<configuration's name>-<date>-<time>`."""
    return RUNS / f"{config_path.stem}-{now:{_TIME}}"


def newest_run(runs: Path = RUNS) -> RunDirectory:
    """The run that was made last.

    Raises:
        NoSuchRun: there is no run in `runs`.
    """
    made = [RunDirectory(config.parent) for config in sorted(runs.glob("*/config.toml"))]
    if not made:
        raise NoSuchRun(f"there is no run in {runs} yet; start one with 'orchestrator train CONFIG'")
    return max(made, key=_made)


def _made(run: RunDirectory) -> tuple[float, str]:
    """The sort key of a run by age: the recorded time, then the time in its name, for old runs have that only."""
    try:
        made = run.versions().made
    except DamagedRecord:
        made = 0.0
    return made, run.path.name[-len(f"{datetime.min:{_TIME}}") :]
