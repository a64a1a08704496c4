"""Draw some views of test scenes with whatever this process's EGL gives; a process of `benchmarks.accelerator`."""

from collections.abc import Iterator, Sequence
from contextlib import closing

import cv2
import numpy as np

from benchmarks.accelerator.measured import Measured, hand_over, options_of, save_arrays
from benchmarks.estimation.viewpoints import all_views
from orchestrator.pictures.view import camera_at
from protocol.camera import Camera
from protocol.config import RunConfig
from protocol.frame import Frame
from protocol.scene import Scene
from render_worker.assets import assets_path, load_assets
from render_worker.opengl import OpenGlRenderer
from render_worker.scenes import sample_scene

SOFTWARE = ("llvmpipe", "softpipe", "swrast")
"""Mesa's names of its software rasterisers."""


VIEWS = 4
"""Of each scene: the first picture of one costs as much as ten others."""


def views(count: int) -> Iterator[tuple[Scene, Camera]]:
    """Test scenes, each seen from some places of its own."""
    environment = RunConfig().environment
    for number, viewpoint in zip(range(count), all_views(seed=0), strict=False):
        scene = sample_scene(number // VIEWS, "test", 0)
        yield scene, camera_at(viewpoint, scene, environment)


def rendered(renderer: OpenGlRenderer, count: int) -> tuple[list[Frame], list[Frame]]:
    """The first frame of every scene, which also uploads it, and then every view."""
    first, found = list[Frame](), list[Frame]()
    for number, (scene, camera) in enumerate(views(count)):
        if number % VIEWS == 0:
            first.append(renderer.render(scene, camera))
        found.append(renderer.render(scene, camera))
    return first, found


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and hand over."""
    options = options_of(arguments, __doc__)
    cv2.setNumThreads(1)
    config = RunConfig().render
    with closing(OpenGlRenderer(load_assets(assets_path(config.bodies)), threads=config.threads)) as renderer:
        first, found = rendered(renderer, options.count)
    arrays = {"rgb": np.stack([one.rgb for one in found]), "depth": np.stack([one.depth for one in found])}
    hand_over(
        Measured(
            device=renderer.device,
            on_gpu=not any(name in renderer.device.lower() for name in SOFTWARE),
            seconds={
                "render, first of a scene": [one.timings["render"] for one in first],
                "render": [one.timings["render"] for one in found],
            },
            digests=save_arrays(options.arrays, arrays),
        )
    )


if __name__ == "__main__":
    main()
