"""Whether each room can do what it does in a run, tried by a process of its own.

A bad driver may crash it, and none of the rooms' packages is wanted in the orchestrator.
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
"""The render room has no command that only looks."""
MAKE_LEARNER = """
from agent.learning.algorithms import make_learner
from protocol.config import RunConfig
config = RunConfig()
make_learner(config.learner, config.environment, seed=0)
print(f"a learner by {config.learner.algorithm} is made")
"""


def check_opengl() -> Check:
    """Something can render without a screen."""
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
    """A perception worker's engine opens, and looks at a picture."""
    return probe("perceiving", module_command("perception_worker.probe"), remedy=_AS_IN_A_RUN)


def check_learning() -> Check:
    """An agent's learner can be made."""
    return probe("learning", (sys.executable, "-P", "-c", MAKE_LEARNER), remedy=_AS_IN_A_RUN)


_AS_IN_A_RUN = "mend what is said here and above: a run would end with the same words"


def probe(name: str, command: tuple[str, ...], remedy: str) -> Check:
    """Ask a process; it passes by its exit code, and its last line is what was found."""
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
        # A process that a signal killed (a broken driver, say) has said nothing of it itself.
        return ending(done.returncode)
    # What libraries warn of beside an answer is none.
    words = done.stdout.strip() or done.stderr if done.returncode == 0 else done.stderr.strip() or done.stdout
    lines = [line.strip() for line in words.splitlines() if line.strip()]
    # A traceback ends with the error's type, which says nothing to people.
    return re.sub(r"^(\w+\.)+\w+: ", "", lines[-1]) if lines else "no word"
