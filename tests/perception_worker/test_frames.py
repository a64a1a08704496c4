"""How frames come: packed where that is worth it, to the same bytes, and from workers that know nothing of it."""

import time
from contextlib import contextmanager

import numpy as np
import pytest
from msgspec.structs import replace

from perception_worker.detection import WholeFrameDetector
from perception_worker.frames import RenderedFrames, RenderedPictures, chosen, opened_by
from perception_worker.perceive import Perceiver
from perception_worker.worker import PerceptionHandlers
from protocol import Client, Pool
from protocol.config import PerceptionConfig
from protocol.errors import CallFailed, MalformedMessage, Rejected
from protocol.frame import ENCODINGS
from protocol.messages import Observe, Perceive, Render, Role
from protocol.packing.packing import pack
from protocol.pose_estimate import FilterState
from protocol.region import Region
from tests.perception_worker.drawn_maps import DrawnNetwork, person
from tests.perception_worker.workers import PATIENCE, SCENE
from tests.protocol.values.pictures import smooth_frame
from tests.protocol.values.sameness import same
from tests.serving import serving

PICTURE = smooth_frame(480, 640)
OBSERVE = Observe(scene=SCENE, camera=PICTURE.camera, filter=FilterState.initial())
HERE, THERE = "ipc:///tmp/render", "tcp://gpu-box:5601"


def packs(request):
    return pack(PICTURE, request.encoding)


def knows_no_packing(request):
    return PICTURE


def cuts(request):
    return pack(PICTURE.part(request.region or PICTURE.area), request.encoding)


def cuts_as_it_likes(request):
    return PICTURE.part(Region(0, 0, 8, 8))


def looks_elsewhere(request):
    return smooth_frame(240, 320)


def packs_as_it_likes(request):
    return pack(PICTURE, "jpeg")


def packs_nonsense(request):
    packed = pack(PICTURE, "lossless")
    return replace(packed, packed=replace(packed.packed, depth=np.zeros(9, np.uint8)))


def fetched(frames, region=None):
    """The frame of `OBSERVE`, or a part of it, and what it took."""
    pictures = frames.of(OBSERVE)
    frame = pictures.part(region or pictures.area)
    return replace(frame, timings=pictures.timings)


@contextmanager
def asking(handler, tmp_path, encoding):
    address = f"ipc://{tmp_path}/render"
    with (
        serving({Render: handler}, address, role=Role.RENDER),
        Pool([address], role=Role.PERCEPTION, serves=Role.RENDER, timeouts=PATIENCE) as pool,
    ):
        yield RenderedFrames(pool, deadline=20.0, encoding=encoding, clock=time.perf_counter)


@pytest.mark.parametrize(
    ("addresses", "encoding"),
    [
        ((), "none"),
        ((HERE,), "none"),
        (("tcp://127.0.0.1:5601", "tcp://localhost:5601", "tcp://[::1]:5601"), "none"),
        ((THERE,), "lossless"),
        (("tcp://10.0.0.7:5601",), "lossless"),
        ((HERE, THERE), "lossless"),
    ],
    ids=str,
)
def test_left_to_us_frames_are_packed_without_loss_from_other_machines_only(addresses, encoding):
    assert chosen("auto", addresses) == encoding


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_what_was_told_holds_for_any_machine(encoding):
    assert {chosen(encoding, (address,)) for address in (HERE, THERE)} == {encoding}


@pytest.mark.parametrize("encoding", ["none", "lossless"])
def test_a_frame_comes_to_the_bit(encoding, tmp_path):
    with asking(packs, tmp_path, encoding) as frames:
        frame = fetched(frames)
    assert same(replace(frame, timings=PICTURE.timings), PICTURE)


def test_a_jpeg_is_asked_for_and_has_the_same_depth(tmp_path):
    with asking(packs, tmp_path, "jpeg") as frames:
        frame = fetched(frames)
    assert frame.rgb.tobytes() != PICTURE.rgb.tobytes()
    assert frame.depth.tobytes() == PICTURE.depth.tobytes()


@pytest.mark.parametrize("encoding", ["lossless", "jpeg"])
def test_a_worker_that_knows_no_packing_answers_as_ever(encoding, tmp_path):
    with asking(knows_no_packing, tmp_path, encoding) as frames:
        assert same(replace(fetched(frames), timings=PICTURE.timings), PICTURE)


@pytest.mark.parametrize("encoding", ["none", "lossless"])
def test_a_jpeg_that_nobody_asked_for_is_malformed(encoding, tmp_path):
    with (
        asking(packs_as_it_likes, tmp_path, encoding) as frames,
        pytest.raises(MalformedMessage, match=f"came as jpeg, {encoding} was asked for"),
    ):
        fetched(frames)


def test_a_frame_that_can_not_be_opened_is_malformed(tmp_path):
    with asking(packs_nonsense, tmp_path, "lossless") as frames, pytest.raises(MalformedMessage, match="packed depth"):
        fetched(frames)


PART = Region(100, 50, 200, 160)


@pytest.mark.parametrize("encoding", ["none", "lossless"])
@pytest.mark.parametrize("worker", [cuts, knows_no_packing])
def test_a_part_is_the_same_whether_the_worker_knows_regions_or_sends_everything(worker, encoding, tmp_path):
    with asking(worker, tmp_path, encoding) as frames:
        part = fetched(frames, PART)
    assert same(replace(part, timings=PICTURE.timings), PICTURE.part(PART))


def test_a_region_that_nobody_asked_for_is_malformed(tmp_path):
    with asking(cuts_as_it_likes, tmp_path, "none") as frames:
        for region in (PART, None):
            with pytest.raises(MalformedMessage, match="was asked for"):
                fetched(frames, region)


def test_a_frame_of_another_camera_is_malformed(tmp_path):
    with asking(looks_elsewhere, tmp_path, "none") as frames, pytest.raises(MalformedMessage, match="another camera"):
        fetched(frames)


def test_what_two_looks_took_is_added_up(tmp_path):
    with asking(cuts, tmp_path, "none") as frames:
        pictures = frames.of(OBSERVE)
        first, second = (pictures.part(region).timings for region in (PART, pictures.area))
    assert pictures.timings["render"] == pytest.approx(first["render"] + second["render"])


def test_all_looks_of_a_request_have_its_time_together(tmp_path):
    with asking(cuts, tmp_path, "none") as frames:
        pictures = RenderedPictures(frames, OBSERVE, until=time.perf_counter())
        with pytest.raises(CallFailed):
            pictures.part(PART)


def test_what_packing_took_is_told_only_where_it_was_done(tmp_path):
    with asking(packs, tmp_path, "lossless") as frames:
        assert fetched(frames).timings.keys() == {"render", "transport", "unpack"}
    assert opened_by(time.perf_counter, PICTURE) is PICTURE


class TestWorker:
    @pytest.fixture
    def client(self, tmp_path):
        address = f"ipc://{tmp_path}/perception"
        perceiver = Perceiver(WholeFrameDetector(DrawnNetwork(person(20, 14))), PerceptionConfig())
        with Pool([], role=Role.PERCEPTION, serves=Role.RENDER) as nobody:
            handlers = PerceptionHandlers(perceiver, nobody, render_deadline=1.0).table()
            with (
                serving(handlers, address, role=Role.PERCEPTION),
                Client(address, role=Role.AGENT, serves=Role.PERCEPTION, timeouts=PATIENCE) as client,
            ):
                yield client

    @pytest.mark.slow
    def test_perceives_a_packed_frame_as_the_frame(self, client):
        seen = [
            client.call(Perceive(frame=frame, filter=FilterState.initial()))
            for frame in (PICTURE, pack(PICTURE, "lossless"))
        ]
        assert same(*(replace(one, timings={}) for one in seen))

    @pytest.mark.slow
    def test_refuses_a_frame_that_can_not_be_opened_and_goes_on(self, client):
        with pytest.raises(Rejected, match="packed depth") as refused:
            client.call(Perceive(frame=packs_nonsense(None), filter=FilterState.initial()))
        assert (refused.value.code, refused.value.retryable) == ("malformed-message", False)
        assert client.call(Perceive(frame=PICTURE, filter=FilterState.initial())).filter.seen.any()
