"""Checks of each room's packages."""

from collections.abc import Iterable

from packaging.requirements import Requirement

from orchestrator.doctor.check import Check
from orchestrator.run.versions import installed_version

ROOMS = ("render", "perception", "agent", "orchestrator")


def check_packages(room: str, declared: Iterable[Requirement]) -> Check:
    """A room's packages are installed, in versions that it can use."""
    wanted = [requirement for requirement in declared if belongs_to(requirement, room)]
    lacking = [str(requirement.name) + str(requirement.specifier) for requirement in wanted if not is_met(requirement)]
    own = [requirement for requirement in wanted if requirement.marker is not None]
    present = [f"{requirement.name} {installed_version(requirement.name)}" for requirement in own]
    install = f"pip install 'vantage[{room}]' (in a checkout: pip install -c constraints.txt -e '.[{room}]')"
    if not wanted:
        return Check(name=f"{room} packages", passed=False, found="Vantage itself is not installed", remedy=install)
    found = f"missing or too old: {', '.join(lacking)}" if lacking else ", ".join(present)
    return Check(name=f"{room} packages", passed=not lacking, found=found, remedy=install if lacking else "")


def belongs_to(requirement: Requirement, room: str) -> bool:
    """Whether a room needs a package that Vantage's metadata names: one of its extra, or one of all rooms."""
    return requirement.marker is None or requirement.marker.evaluate({"extra": room})


def is_met(requirement: Requirement) -> bool:
    """Whether it is installed in a required version."""
    version = installed_version(requirement.name)
    return version is not None and requirement.specifier.contains(version, prereleases=True)
