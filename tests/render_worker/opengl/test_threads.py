"""Several threads ask one renderer at once."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from protocol.messages import Render
from protocol.region import Region
from render_worker.scenes import sample_scene

pytestmark = pytest.mark.slow

SCENES = [sample_scene(seed, "train") for seed in (31, 32, 31, 33, 32, 34)]


def picture(renderer, request):
    frame = renderer.render(request)
    return frame.rgb.tobytes(), frame.depth.tobytes()


def test_frames_drawn_while_other_scenes_are_prepared_have_the_same_bytes(renderer, look_at):
    requests = [
        Render(scene=scene, camera=look_at(scene, 30 * place, 3, size=(160, 120)), region=Region(20, 10, 90, 80))
        for place, scene in enumerate(SCENES)
    ]
    with ThreadPoolExecutor(3) as threads:
        at_once = list(threads.map(lambda request: picture(renderer, request), requests))
    assert at_once == [picture(renderer, request) for request in requests]
