"""The worker's other thread must get its turns while a frame is drawn."""

import threading
import time

import pytest

from protocol.camera import Camera, CameraPose, Intrinsics
from protocol.config import RenderConfig
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

pytestmark = pytest.mark.slow


def test_another_thread_gets_turns_while_a_large_frame_is_drawn():
    renderer = open_renderer(RenderConfig())
    scene = sample_scene(0, "train")
    # Large, so that drawing takes far longer than a thread's turn on any machine.
    camera = Camera(CameraPose((3.0, 0.0, 1.5), (0.0, 0.0, 1.0)), Intrinsics.from_horizontal_fov(2560, 1920, 70.0))
    renderer.render(scene, camera)
    turns: list[float] = []
    drawn = threading.Event()

    def take_turns() -> None:
        while not drawn.is_set():
            time.sleep(0.001)
            turns.append(time.perf_counter())

    other = threading.Thread(target=take_turns)
    other.start()
    begun = time.perf_counter()
    renderer.render(scene, camera)
    ended = time.perf_counter()
    drawn.set()
    other.join()
    renderer.close()
    pauses = [after - before for before, after in zip([begun, *turns], [*turns, ended], strict=True) if before < ended]
    assert max(pauses) < 0.5 * (ended - begun), f"of {ended - begun:.3f} s the longest pause was {max(pauses):.3f} s"
