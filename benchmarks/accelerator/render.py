"""Draw some views of test scenes with whatever this process's EGL gives; a process of `benchmarks.accelerator`."""

from collections.abc import Iterator, Sequence
from contextlib import closing

import cv2
import numpy as np

from benchmarks.accelerator.measured import Measured, hand_over, options_of, save_arrays
from benchmarks.viewpoints import all_views
from orchestrator.view import camera_at
from protocol.camera import Camera
from protocol.config import RunConfig
from protocol.frame import Frame
from protocol.messages import Render
from protocol.scene import Scene
from render_worker.opengl import OpenGlRenderer
from render_worker.renderer import open_renderer
from render_worker.scenes import sample_scene

SOFTWARE = ("llvmpipe", "softpipe", "swrast")
"""How Mesa calls what draws without a GPU."""


def views(count: int) -> Iterator[tuple[Scene, Camera]]:
    """Test scenes, each seen from a place of its own."""
    for seed, viewpoint in zip(range(count), all_views(seed=0), strict=False):
        scene = sample_scene(seed, "test", 0)
        yield scene, camera_at(viewpoint, scene, RunConfig().environment)


def rendered(renderer: OpenGlRenderer, count: int) -> tuple[list[Frame], list[Frame]]:
    """Every view twice: the first frame of a scene also uploads it."""
    requests = [Render(scene=scene, camera=camera) for scene, camera in views(count)]
    pairs = [(renderer.render(request), renderer.render(request)) for request in requests]
    return [first for first, _ in pairs], [second for _, second in pairs]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and hand over."""
    options = options_of(arguments, __doc__)
    cv2.setNumThreads(1)
    with closing(open_renderer(RunConfig().render)) as renderer:
        assert isinstance(renderer, OpenGlRenderer)
        # Asked before anything is drawn: afterwards the thread has no current context that could tell.
        device = renderer.device
        first, second = rendered(renderer, options.count)
    arrays = {"rgb": np.stack([one.rgb for one in second]), "depth": np.stack([one.depth for one in second])}
    hand_over(
        Measured(
            device=device,
            on_gpu=not any(name in device.lower() for name in SOFTWARE),
            seconds={
                "render, first of a scene": [one.timings["render"] for one in first],
                "render": [one.timings["render"] for one in second],
            },
            digests=save_arrays(options.arrays, arrays),
        )
    )


if __name__ == "__main__":
    main()
