"""The compliance suite as the author of a worker runs it: in a process of its own."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple


class Verdict(NamedTuple):
    """How a run of the suite ended.

    Attributes:
        failed, passed: names of the rules, without parameters.
    """

    code: int
    failed: set[str]
    passed: set[str]
    output: str


def judge(*options: str, folder: Path) -> Verdict:
    """Run the suite with `folder` as working directory, away from this repository's own pytest settings."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "--pyargs",
        "protocol.compliance",
        "-rA",
        "-p",
        "no:cacheprovider",
        *options,
    ]
    clean = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    root = str(Path(__file__).parents[3])
    done = subprocess.run(
        command, cwd=folder, env=clean | {"PYTHONPATH": root}, capture_output=True, text=True, check=False
    )
    failed = _rules("FAILED|ERROR", done.stdout)
    return Verdict(done.returncode, failed, _rules("PASSED", done.stdout) - failed, done.stdout + done.stderr)


def _rules(outcome: str, output: str) -> set[str]:
    return set(re.findall(rf"^(?:{outcome}) \S*::(\w+)", output, re.MULTILINE))
