import msgspec
import pytest
from msgspec.structs import replace

from perception_worker.calibration.choice import open_calibration, setting_of
from protocol.config import PerceptionConfig, settled
from protocol.errors import InvalidConfig
from tests.perception_worker.calibration.trees import SETTING, stored

OURS = settled(PerceptionConfig(look="whole"), "vantage")
TRACKS = settled(PerceptionConfig(), "vantage")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "some.msgpack"
    path.write_bytes(msgspec.msgpack.encode(stored()))
    return path


class TestOpen:
    def test_none_is_none(self):
        assert open_calibration(replace(OURS, calibration="none")) is None

    def test_reads_the_file_that_is_named(self, file):
        opened = open_calibration(replace(OURS, calibration=str(file)))
        assert opened is not None
        assert opened.setting == SETTING

    @pytest.mark.parametrize(
        "config",
        [
            replace(OURS, lifting="mean"),
            replace(OURS, input_height=256),
            replace(OURS, look="track"),
            replace(OURS, look="track", input_height=240, input_width=320),
            replace(OURS, peak_threshold=0.2),
            replace(OURS, network="another.onnx"),
            replace(OURS, network="movenet_thunder"),
        ],
    )
    def test_refuses_one_that_was_fitted_for_another_setting(self, file, config):
        with pytest.raises(InvalidConfig, match=r"was fitted for .* this worker has"):
            open_calibration(replace(config, calibration=str(file)))

    def test_fits_no_network_that_none_was_fitted_for(self):
        assert open_calibration(replace(OURS, network="movenet_thunder")) is None

    @pytest.mark.parametrize("config", [OURS, TRACKS])
    def test_fits_the_worker_of_either_look(self, config):
        opened = open_calibration(config)
        assert opened is not None
        assert set(opened.provenance.fitted_on).isdisjoint(opened.provenance.calibrated_on)
        assert max(*opened.provenance.fitted_on, *opened.provenance.calibrated_on) < 40


def test_what_is_left_to_the_network_is_the_same_setting_as_its_own_values():
    assert setting_of(replace(OURS, input_height=240, input_width=320, peak_threshold=0.1)) == SETTING
    assert setting_of(OURS) == SETTING
    assert setting_of(replace(TRACKS, region_height=176, region_width=120)) == setting_of(TRACKS)
