"""What the edges share: the command as a process, and a run that has come to its end."""

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec
import pytest

from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.versions import collect_versions
from protocol.config import RunConfig
from protocol.records import Evaluation, Interval, PolicyScore, Progress, Summary
from tests.orchestrator.conftest import orchestrator, wait_until

__all__ = ["command", "finished_run", "orchestrator", "wait_until"]

PATIENCE = 120.0


@pytest.fixture
def finished_run(tmp_path: Path) -> RunDirectory:
    """A run as an earlier version left it, all of it done."""
    run = RunDirectory.create(tmp_path / "finished", RunConfig(), collect_versions({}))
    progress = Progress(time=1e9, phase="evaluation", step=1404, steps=1600, episodes=0, steps_per_second=10.4)
    summary = Summary(
        steps=4000,
        episodes=40,
        updates=4000,
        seconds=83.0,
        steps_per_second=48.0,
        stages={"render": 0.05},
        late_replies=0,
        retries=0,
    )
    half = Interval(0.5, 0.4, 0.6)
    score = PolicyScore(
        policy="sac", episodes=16, total_reward=half, uncertainty=half, success=half, crash=half, length=half
    )
    evaluation = Evaluation(first_seed=1, success_threshold=1.6, scores=(score,))
    run.progress_path.write_bytes(msgspec.json.encode(progress) + b"\n")
    run.weights_path.touch()
    run.summary_path.write_bytes(msgspec.json.encode(summary))
    run.evaluation_path.write_bytes(msgspec.json.encode(evaluation))
    return run


@pytest.fixture
def command() -> Callable[..., subprocess.CompletedProcess[bytes]]:
    """Runs the `orchestrator` command to its end, as a process with streams and an environment of its own."""

    def run(
        *arguments: str | bytes | Path,
        before: tuple[str, ...] = (),
        environment: Mapping[str, str] | None = None,
        **streams: object,
    ) -> subprocess.CompletedProcess[bytes]:
        return subprocess.run(
            [*before, sys.executable, "-m", "orchestrator", *arguments],
            env={**os.environ, **(environment or {})},
            timeout=PATIENCE,
            check=False,
            **({"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | streams),  # pyright: ignore[reportCallIssue, reportArgumentType]
        )

    return run
