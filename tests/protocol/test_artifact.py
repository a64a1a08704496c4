from pathlib import Path

import pytest

from protocol.artifact import cache_directory, require_artifact, sha256, whole_file
from protocol.errors import ArtifactDamaged, ArtifactMissing


def test_a_file_appears_whole(tmp_path: Path):
    with whole_file(tmp_path / "bodies.npz") as aside:
        aside.write_bytes(b"all of it")
        assert not (tmp_path / "bodies.npz").exists()
    assert (tmp_path / "bodies.npz").read_bytes() == b"all of it"
    assert [path.name for path in tmp_path.iterdir()] == ["bodies.npz"]


def test_a_write_that_fails_leaves_the_previous_file_and_nothing_else(tmp_path: Path):
    def fail_in_the_middle():
        with whole_file(tmp_path / "bodies.npz") as aside:
            aside.write_bytes(b"half")
            raise OSError("disk full")

    (tmp_path / "bodies.npz").write_bytes(b"previous")
    with pytest.raises(OSError, match="disk full"):
        fail_in_the_middle()
    assert (tmp_path / "bodies.npz").read_bytes() == b"previous"
    assert [path.name for path in tmp_path.iterdir()] == ["bodies.npz"]


def test_a_missing_artifact_names_the_command_that_makes_it(tmp_path: Path):
    with pytest.raises(ArtifactMissing, match="orchestrator bodies bake"):
        require_artifact(tmp_path / "bodies.npz", made_by="orchestrator bodies bake")


def test_an_artifact_of_another_checksum_is_refused(tmp_path: Path):
    path = tmp_path / "network.onnx"
    path.write_bytes(b"network")
    assert require_artifact(path, made_by="orchestrator models pull", checksum=sha256(path)) == path
    with pytest.raises(ArtifactDamaged, match="makes it anew"):
        require_artifact(path, made_by="orchestrator models pull", checksum="0" * 64)


def test_the_cache_can_be_moved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path / "elsewhere"))
    assert cache_directory() == tmp_path / "elsewhere"
