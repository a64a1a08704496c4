"""Prints what pip has to install for some extras: a layer that changes with pyproject.toml, not with our code."""

import argparse
import re
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path


def requirements(project: Path, extras: Sequence[str], without: Sequence[str] = ()) -> list[str]:
    """The requirements of a `pyproject.toml`'s package with some extras, less the packages named in `without`."""
    described = tomllib.loads(project.read_text())["project"]
    optional = described["optional-dependencies"]
    lines = described["dependencies"] + [line for extra in extras for line in optional[extra]]
    return [line for line in dict.fromkeys(lines) if package_name(line) not in without]


def package_name(requirement: str) -> str:
    """The package that a requirement such as `torch>=2.7` asks for."""
    return re.split(r"[^A-Za-z0-9._-]", requirement, maxsplit=1)[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("extras", nargs="+")
    parser.add_argument("--project", type=Path, default=Path("pyproject.toml"))
    parser.add_argument("--without", default="", help="names of packages to leave out, separated by spaces")
    chosen = parser.parse_args()
    sys.stdout.write("\n".join(requirements(chosen.project, chosen.extras, chosen.without.split())) + "\n")


if __name__ == "__main__":
    main()
