"""Checks whether this machine has what Vantage needs, and says what to do about each thing that it lacks.

Each check does what a run does, so that it fails where the run would fail.
"""

from collections.abc import Callable, Iterator
from functools import partial

from orchestrator.doctor import machine, rooms
from orchestrator.doctor.check import Check, all_needed_passed
from orchestrator.doctor.packages import ROOMS, check_packages
from orchestrator.doctor.table import checks_table
from orchestrator.run.versions import requirements
from protocol.errors import VantageError
from protocol.system.refusal import SYSTEM_ERRORS, sentence

__all__ = ["Check", "all_checks", "all_needed_passed", "checks_table", "done"]


def all_checks() -> Iterator[Check]:
    """The results of all checks, quick ones first."""
    declared = tuple(requirements())
    checks: dict[str, Callable[[], Check]] = {
        "Python": machine.check_python,
        "cores": machine.check_cores,
        "memory": machine.check_memory,
        "disk": machine.check_disk,
        "files": machine.check_files,
        "cache": machine.check_cache,
        "sockets": machine.check_sockets,
        "own name": machine.check_own_name,
        **{f"{room} packages": partial(check_packages, room, declared) for room in ROOMS},
        "OpenGL over EGL": rooms.check_opengl,
        "pose network": rooms.check_network,
        "bodies": rooms.check_bodies,
        "drawing": rooms.check_drawing,
        "perceiving": rooms.check_perceiving,
        "learning": rooms.check_learning,
    }
    yield from (done(name, check) for name, check in checks.items())


def done(name: str, check: Callable[[], Check]) -> Check:
    """Run a check; an error of ours or of the system counts as a failed check."""
    try:
        return check()
    except VantageError as error:
        return _failed(name, str(error))
    except SYSTEM_ERRORS as error:
        return _failed(name, sentence(error))


def _failed(name: str, found: str) -> Check:
    what, _, remedy = found.rpartition("; ")
    return Check(name=name, passed=False, found=what or found, remedy=remedy if what else "")
