from msgspec.structs import replace

from perception_worker.detection.choice import quick_search_size
from perception_worker.networks.backend import input_size
from protocol.config import PerceptionConfig


class TestQuickSearch:
    TRACK = PerceptionConfig(look="track")

    def test_comes_first_where_no_size_is_named(self):
        assert (quick_search_size(self.TRACK), input_size(self.TRACK)) == ((240, 320), (320, 424))

    def test_is_left_out_where_a_size_is_named(self, tiny_onnx):
        assert quick_search_size(replace(self.TRACK, input_height=320)) is None
        assert quick_search_size(replace(self.TRACK, input_width=160)) is None
        assert quick_search_size(replace(self.TRACK, network="movenet_lightning")) is None
        assert quick_search_size(replace(self.TRACK, network=str(tiny_onnx))) is None
