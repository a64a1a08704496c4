"""A renderer on OpenGL that keeps what doesn't change between the frames of a scene.

What a scene needs (the posed and clothed bodies, their textures, their shadow) is uploaded once and kept for the scenes
used last; that saves time and changes no byte. Most of the work for a new scene needs no OpenGL, and is done while
another thread draws.
"""

import importlib.resources
import os
import threading
import time
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from protocol.arrays import Float32Array, UInt8Array
from protocol.camera import Camera
from protocol.errors import Unavailable
from protocol.frame import Frame
from protocol.region import Region
from protocol.scene import Scene
from render_worker.assets import Assets
from render_worker.opengl.drawing import Drawing, View
from render_worker.opengl.finish import finish_function
from render_worker.opengl.nearest import nearest_surface
from render_worker.opengl.picture import read_colours, read_depth
from render_worker.opengl.prepared import prepare
from render_worker.opengl.scene_cache import SceneCache
from render_worker.opengl.staging import Programs, Staged, Staging
from render_worker.stereo_noise import measure_part, noise_seed, seen_around
from render_worker.surroundings.surroundings import is_hall, require_names
from render_worker.visibility import visible_joints, with_joints

if TYPE_CHECKING:
    from moderngl import Context, Framebuffer

_SURROUNDINGS_KEPT = 12
_SIZES_KEPT = 4


class OpenGlRenderer:
    """Draws scenes with OpenGL 3.3; may be called by several threads at once, of which one draws at a time.

    Args:
        assets: the baked bodies.
        threads: of Mesa's software rasteriser, 0 for the calling thread alone; a GPU doesn't care.
        scenes_kept: how many scenes stay uploaded, some 20 MB each.

    Raises:
        Unavailable: there is no EGL, or no OpenGL 3.3 behind it.
    """

    def __init__(self, assets: Assets, *, threads: int = 0, scenes_kept: int = 16) -> None:
        self._assets = assets
        # A context belongs to one thread at a time.
        self._drawing_now = threading.Lock()
        self._context = _open_context(threads)
        self._finish = finish_function()
        # A new context is current in this thread until it is left once; until then no other thread can draw.
        with self._context:
            self._device = str(self._context.info["GL_RENDERER"])
            programs = _compile(self._context)
            self._drawing = Drawing(self._context, programs)
            self._staging = Staging(self._context, programs, assets)
        # What drops out of a cache is given back to OpenGL by the context's own collection.
        self._grounds = lru_cache(_SURROUNDINGS_KEPT)(self._staging.ground)
        self._backdrops = lru_cache(_SURROUNDINGS_KEPT)(self._staging.backdrops)
        self._scenes = SceneCache(scenes_kept)
        self._targets = lru_cache(_SIZES_KEPT)(self._target)

    @property
    def device(self) -> str:
        """The device that draws, by the driver's name."""
        return self._device

    def render(self, scene: Scene, camera: Camera, *, region: Region | None = None, truth: bool = False) -> Frame:
        """Draw one frame; see `Renderer.render`."""
        started = time.perf_counter()
        require_names(scene.ground, scene.background)
        asked = region or Region.seen_by(camera.intrinsics)
        staged = self._staged(scene)
        drawn = _needed(asked, scene, camera, staged)
        if truth:
            drawn = with_joints(drawn, staged.joints, camera)
        rgb, depth = self._draw(scene, camera, staged, drawn, asked)
        visible = visible_joints(staged.joints, depth, camera, drawn) if truth else None
        return Frame(
            rgb=rgb,
            depth=_measured(depth, drawn, asked, scene, camera),
            camera=camera,
            joints=staged.joints.copy() if truth else None,
            visible=visible,
            timings={"render": time.perf_counter() - started},
            region=region,
        )

    def close(self) -> None:
        """Give back the context and everything in it."""
        self._scenes.clear()
        for cache in (self._grounds, self._backdrops, self._targets):
            cache.cache_clear()
        self._context.release()

    def _staged(self, scene: Scene) -> Staged:
        """The scene as OpenGL has it; a new one is prepared and uploaded first."""
        with self._drawing_now:
            staged = self._scenes.get(scene)
        if staged is not None:
            return staged
        with self._drawing_now, self._context:
            extent = self._grounds(scene.ground).extent
        prepared = prepare(self._assets, scene, extent)
        with self._drawing_now, self._context:
            staged = self._staging.scene(prepared)
            self._scenes.put(scene, staged)
        return staged

    def _draw(
        self, scene: Scene, camera: Camera, staged: Staged, drawn: Region, asked: Region
    ) -> tuple[UInt8Array, Float32Array]:
        """The colours of the region that was asked for, and the true depth of all that was drawn."""
        # OpenGL draws into the thread's current context, which may be another renderer's.
        with self._drawing_now, self._context:
            target = self._targets((camera.intrinsics.width, camera.intrinsics.height))
            view, ground = View.of(target, camera, drawn), self._grounds(scene.ground)
            self._drawing.draw(view, staged, ground, self._backdrops(scene.background))
            self._finish()
            rgb, depth = read_colours(target, asked), read_depth(target, drawn)
            self._context.gc()
        return rgb, depth

    def _target(self, size: tuple[int, int]) -> "Framebuffer":
        return self._context.framebuffer([self._context.renderbuffer(size, 4)], self._context.depth_renderbuffer(size))


def _open_context(threads: int) -> "Context":
    # Mesa reads it when the context is made.
    os.environ["LP_NUM_THREADS"] = str(threads)
    import moderngl

    settings: Any = {"backend": "egl"}
    try:
        context = moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:
        raise Unavailable(
            f"no OpenGL 3.3 through EGL on this machine ({error}); "
            "on Debian: apt install libegl1 libgl1 libgl1-mesa-dri"
        ) from error
    context.gc_mode = "context_gc"
    return context


def _compile(context: "Context") -> Programs:
    sources = importlib.resources.files("render_worker.opengl") / "shaders"

    def program(name: str) -> Any:
        vertex, fragment = ((sources / f"{name}.{kind}").read_text(encoding="utf-8") for kind in ("vert", "frag"))
        return context.program(vertex_shader=vertex, fragment_shader=fragment)

    return Programs(*map(program, Programs._fields))


def _needed(region: Region, scene: Scene, camera: Camera, staged: Staged) -> Region:
    """The part of the picture that has to be drawn to measure the depth of a region."""
    if camera.depth_noise == "none":
        return region
    nearest = nearest_surface([one.outline for one in staged.people], camera, hall=is_hall(scene.background))
    return seen_around(region, camera.intrinsics, nearest)


def _measured(depth: Float32Array, drawn: Region, region: Region, scene: Scene, camera: Camera) -> Float32Array:
    """The depth of a region as the camera measures it, out of the true depth of all that was drawn."""
    if camera.depth_noise == "none":
        return np.ascontiguousarray(region.within(drawn).part(depth))
    size = camera.intrinsics.height, camera.intrinsics.width
    return measure_part(depth, drawn, region, size, camera.intrinsics.fx, noise_seed(scene, camera))
