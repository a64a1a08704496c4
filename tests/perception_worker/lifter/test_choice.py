import msgspec
import pytest
from msgspec.structs import replace

from perception_worker.lifter.choice import open_lifter
from perception_worker.networks.network_setting import network_setting
from perception_worker.worker import with_lifter_at_hand
from protocol.config import PerceptionConfig, settled
from protocol.errors import ArtifactDamaged, InvalidConfig
from tests.perception_worker.lifter.bodies import stored

TRACKS = settled(PerceptionConfig(), "vantage")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "some.msgpack"
    path.write_bytes(msgspec.msgpack.encode(replace(stored(), setting=network_setting(TRACKS))))
    return path


def test_reads_the_file_that_is_named(file):
    opened = open_lifter(replace(TRACKS, lifter=str(file)))
    assert opened is not None
    assert opened.setting == network_setting(TRACKS)


@pytest.mark.parametrize(
    "other", [{"region_height": 192}, {"look": "whole"}, {"network": "movenet_thunder"}, {"peak_threshold": 0.3}]
)
def test_refuses_one_that_was_fitted_behind_another_network_or_at_another_size(file, other):
    with pytest.raises(InvalidConfig, match=r"was fitted behind .* this worker has"):
        open_lifter(replace(TRACKS, lifter=str(file), **other))


@pytest.mark.parametrize("content", [b"", b"\x80", b"no lifter", b"\xc1" * 100])
def test_refuses_a_file_that_is_none(tmp_path, content):
    path = tmp_path / "none.msgpack"
    path.write_bytes(content)
    with pytest.raises(ArtifactDamaged, match=r"none\.msgpack"):
        open_lifter(replace(TRACKS, lifter=str(path)))


def test_a_bit_that_has_changed_is_noticed(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    with pytest.raises(ArtifactDamaged):
        open_lifter(replace(TRACKS, lifter=str(file)))


def test_where_none_fits_the_surface_in_front_is_taken():
    other = replace(TRACKS, region_height=192)
    assert open_lifter(other) is None
    assert with_lifter_at_hand(other).lifting == "nearest"


def test_other_ways_of_lifting_are_left_as_they_are():
    thesis = settled(PerceptionConfig(), "thesis")
    assert with_lifter_at_hand(thesis) == thesis


def test_one_is_shipped_for_whoever_tracks_by_default():
    opened = open_lifter(TRACKS)
    assert opened is not None
    assert with_lifter_at_hand(TRACKS).lifting == "learned"
    assert set(opened.provenance.fitted_on).isdisjoint(opened.provenance.calibrated_on)
    assert max(*opened.provenance.fitted_on, *opened.provenance.calibrated_on) < 40
