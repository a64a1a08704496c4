"""Several threads ask one renderer at once."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import pytest

from protocol.config import RenderConfig
from protocol.region import Region
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

pytestmark = pytest.mark.slow

SCENES = [sample_scene(seed, "train") for seed in (31, 32, 31, 33, 32, 34)]
REGION = Region(20, 10, 90, 80)


def picture(renderer, scene, camera):
    frame = renderer.render(scene, camera, region=REGION)
    return frame.rgb.tobytes(), frame.depth.tobytes()


def test_frames_drawn_while_other_scenes_are_prepared_have_the_same_bytes(renderer, look_at):
    views = [(scene, look_at(scene, 30 * place, 3, size=(160, 120))) for place, scene in enumerate(SCENES)]
    with ThreadPoolExecutor(3) as threads:
        at_once = list(threads.map(lambda view: picture(renderer, *view), views))
    assert at_once == [picture(renderer, *view) for view in views]


def test_a_renderer_that_was_just_opened_draws_in_another_thread(renderer, look_at):
    camera = look_at(SCENES[0], 0, 3, size=(160, 120))
    with closing(open_renderer(RenderConfig())) as fresh, ThreadPoolExecutor(1) as thread:
        drawn = thread.submit(picture, fresh, SCENES[0], camera).result()
    assert drawn == picture(renderer, SCENES[0], camera)
