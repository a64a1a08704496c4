"""Whether the perception image's wheels exist for a Jetson; asks pip's index, and installs nothing."""

import subprocess
import sys

from tests.docker.engine import REPOSITORY


def check(*words: str) -> subprocess.CompletedProcess[str]:
    script = str(REPOSITORY / "docker" / "check_aarch64.py")
    return subprocess.run([sys.executable, script, *words], cwd=REPOSITORY, capture_output=True, text=True)


def test_all_that_perceives_has_a_wheel_for_aarch64():
    done = check("perception")
    assert done.returncode == 0, done.stderr
    assert "onnxruntime" in done.stdout


def test_what_has_none_is_named():
    """Nobody has built moderngl for it."""
    done = check("render")
    assert done.returncode == 1
    assert "moderngl" in done.stderr
