"""Checks whether each room can do its work, each in a process of its own.

A bad driver may crash the process, and the orchestrator loads none of the rooms' packages.
"""

import os
import re
import subprocess
import sys

from orchestrator.doctor.check import Check
from orchestrator.supervision.launch import PROCESS_ENVIRONMENT, module_command
from orchestrator.supervision.worker_process import ending
from protocol.system.refusal import reason

PROBE_PATIENCE = 120.0
LOAD_BODIES = """
from render_worker.assets import assets_path, load_assets
load_assets(assets_path())
print(f"{assets_path()} is there and whole")
"""
"""The render room has no command that only checks the bodies."""
MAKE_LEARNER = """
from agent.learning.algorithms import make_learner
from protocol.config import RunConfig
config = RunConfig()
make_learner(config.learner, config.environment, seed=0)
print(f"a learner by {config.learner.algorithm} is made")
"""


def check_opengl() -> Check:
    """A renderer works without a screen."""
    return probe(
        "OpenGL over EGL",
        module_command("orchestrator.doctor.gl_probe"),
        remedy="install a driver (Debian: apt-get install libegl1 libgl1 libgl1-mesa-dri), "
        "then 'orchestrator doctor' again",
    )


def check_network() -> Check:
    """The pose network is in the cache and whole."""
    return probe(
        "pose network", module_command("perception_worker.networks", "check"), remedy="orchestrator models pull"
    )


def check_bodies() -> Check:
    """The bodies are in the cache and whole."""
    return probe("bodies", (sys.executable, "-P", "-c", LOAD_BODIES), remedy="orchestrator bodies bake")


def check_drawing() -> Check:
    """A render worker's renderer opens, and draws a picture."""
    return probe("drawing", module_command("render_worker.probe"), remedy=_AS_IN_A_RUN)


def check_perceiving() -> Check:
    """A perception worker's engine opens, and perceives a picture."""
    return probe("perceiving", module_command("perception_worker.probe"), remedy=_AS_IN_A_RUN)


def check_learning() -> Check:
    """An agent's learner can be made."""
    return probe("learning", (sys.executable, "-P", "-c", MAKE_LEARNER), remedy=_AS_IN_A_RUN)


_AS_IN_A_RUN = "fix what is reported here and above: a run would fail with the same message"


def probe(name: str, command: tuple[str, ...], remedy: str) -> Check:
    """Run a command as a check: its exit code decides, and its last line is what was found."""
    environment = {**os.environ, **PROCESS_ENVIRONMENT}
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=PROBE_PATIENCE,
            check=False,
            env=environment,
        )
    except subprocess.TimeoutExpired:
        return Check(name=name, passed=False, found=f"no answer within {PROBE_PATIENCE:g} s", remedy=remedy)
    except OSError as error:
        return Check(name=name, passed=False, found=f"{command[0]}: {reason(error)}", remedy=remedy)
    passed = done.returncode == 0
    return Check(name=name, passed=passed, found=_said(done), remedy="" if passed else remedy)


def _said(done: subprocess.CompletedProcess[str]) -> str:
    if done.returncode < 0:
        # A process that a signal killed, such as by a broken driver, has printed no reason.
        return ending(done.returncode)
    # Warnings of libraries on stderr are not the result.
    words = done.stdout.strip() or done.stderr if done.returncode == 0 else done.stderr.strip() or done.stdout
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    # A traceback's last line begins with the type of the error, which is left out.
    return re.sub(r"^(\w+\.)+\w+: ", "", lines[-1]) if lines else "no output"
