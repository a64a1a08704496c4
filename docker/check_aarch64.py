"""Says whether pip finds a wheel for aarch64 of everything that a room of ours is installed with; installs nothing.

A Jetson has 64-bit ARM and an older glibc. What it needs of its own, such as ONNX Runtime with TensorRT, is left out
by `--without` where it does not come from the index.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from requirements import requirements

FIRST_GLIBC = 17
"""The oldest manylinux tag of the form `manylinux_2_N`; wheels for an older glibc run on a newer one."""


def wheels(lines: Sequence[str], python: str, glibc: int, constraints: Path) -> dict[str, str]:
    """The wheel's name by package, as pip would install the requirements on such a machine.

    Raises:
        LookupError: there is none for some; the message is pip's.
    """
    platforms = [f"manylinux_2_{minor}_aarch64" for minor in range(glibc, FIRST_GLIBC - 1, -1)]
    platforms.append("manylinux2014_aarch64")
    options = [word for platform in platforms for word in ("--platform", platform)]
    options += ["--implementation", "cp", "--python-version", python, "--only-binary", ":all:"]
    with tempfile.TemporaryDirectory() as folder:
        listed = Path(folder) / "requirements.txt"
        listed.write_text("\n".join(lines) + "\n")
        # A target is asked for where the platform is another; in a dry run nothing is put there.
        options += ["--dry-run", "--ignore-installed", "--target", folder, "--quiet", "--report", "-"]
        command = [sys.executable, "-m", "pip", "install", *options, "--constraint", str(constraints)]
        done = subprocess.run([*command, "--requirement", str(listed)], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise LookupError("\n".join(line for line in done.stderr.splitlines() if line.startswith("ERROR")))
    report: dict[str, Any] = json.loads(done.stdout)
    return {one["metadata"]["name"]: one["download_info"]["url"].rpartition("/")[2] for one in report["install"]}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("room", nargs="?", default="perception")
    parser.add_argument("--python", default="3.11", help="the version on that machine (default: 3.11)")
    parser.add_argument("--glibc", type=int, default=35, help="N of its glibc 2.N (default: 35, Ubuntu 22.04)")
    parser.add_argument("--without", default="", help="packages that come from elsewhere, separated by spaces")
    chosen = parser.parse_args()
    lines = requirements(Path("pyproject.toml"), [chosen.room], chosen.without.split())
    try:
        found = wheels(lines, chosen.python, chosen.glibc, Path("constraints.txt"))
    except LookupError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    for package, wheel in sorted(found.items(), key=lambda one: one[0].lower()):
        sys.stdout.write(f"{package:24} {wheel}\n")
    sys.stdout.write(f"{len(found)} packages, each with a wheel for aarch64, Python {chosen.python}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
