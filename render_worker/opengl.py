"""The default renderer: OpenGL through EGL, on a GPU or on Mesa's llvmpipe.

What doesn't change between the frames of a scene (the posed and clothed body, its textures, its shadow) is uploaded
once and kept for the scenes used last; that saves time and changes no byte.
"""

import importlib.resources
import os
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Any, Generic, NamedTuple, TypeVar

import cv2
import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.camera import Camera, Intrinsics, world_to_camera
from protocol.errors import Unavailable
from protocol.frame import Frame
from protocol.messages import Render
from protocol.scene import Scene
from render_worker.assets import Assets
from render_worker.light import SHADOW_REACH, Light, light_of
from render_worker.person import Person, dress
from render_worker.placing import place_joints, place_person
from render_worker.stereo_noise import measure_depth, noise_seed
from render_worker.surroundings import (
    ground_bands,
    ground_patch,
    is_hall,
    make_ground,
    make_shells,
    require_names,
)
from render_worker.visibility import visible_joints

NEAREST = 0.1
_CLIPPED = 100.0
"""Metres between which anything is drawn."""

_SHADOW_SIZE = 1024
_SURROUNDINGS_KEPT = 12
_SIZES_KEPT = 4

_Value = TypeVar("_Value")


class _Kept(Generic[_Value]):
    """The values used last, at most `limit` of them; what drops out is released."""

    def __init__(self, limit: int, release: Callable[[_Value], None]) -> None:
        self._limit, self._release = limit, release
        self._values: OrderedDict[Hashable, _Value] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], _Value]) -> _Value:
        """The value of a key, made if it is not kept."""
        if key not in self._values:
            self._values[key] = make()
            if len(self._values) > self._limit:
                self._release(self._values.popitem(last=False)[1])
        self._values.move_to_end(key)
        return self._values[key]


class _Target(NamedTuple):
    """Where frames of one size are drawn."""

    framebuffer: Any
    resources: tuple[Any, ...]


class _Picture(NamedTuple):
    """A textured surface on the GPU."""

    array: Any
    texture: Any
    solid: bool
    resources: tuple[Any, ...]


class _Staged(NamedTuple):
    """A scene's own things on the GPU, and the true joints in the world frame."""

    closed: Any
    open: Any
    patch: Any
    bands: Any
    textures: Any
    shadow: Any
    light: Light
    joints: Float64Array
    resources: tuple[Any, ...]


class OpenGlRenderer:
    """Draws scenes with OpenGL 3.3.

    Args:
        assets: the baked bodies.
        threads: of Mesa's software rasteriser, 0 for the calling thread alone; a GPU doesn't care.
        scenes_kept: how many scenes stay uploaded, some 8 MB each.

    Raises:
        Unavailable: there is no EGL, or no OpenGL 3.3 behind it.
    """

    def __init__(self, assets: Assets, *, threads: int = 0, scenes_kept: int = 16) -> None:
        self._assets = assets
        self._context = _open_context(threads)
        self._person = self._program("person", "person")
        self._caster = self._program("shadow", "shadow")
        self._ground = self._program("ground", "ground")
        self._shell = self._program("surroundings", "surroundings")
        self._scenes: _Kept[_Staged] = _Kept(scenes_kept, _release)
        self._shells: _Kept[tuple[_Picture, ...]] = _Kept(_SURROUNDINGS_KEPT, _release_all)
        self._grounds: _Kept[tuple[Any, float]] = _Kept(_SURROUNDINGS_KEPT, _release_ground)
        self._targets: _Kept[_Target] = _Kept(_SIZES_KEPT, _release)

    @property
    def device(self) -> str:
        """What draws, in the driver's words."""
        return str(self._context.info["GL_RENDERER"])

    def render(self, request: Render) -> Frame:
        """Draw one frame; see `Renderer.render`."""
        started = time.perf_counter()
        scene, camera = request.scene, request.camera
        require_names(scene.ground, scene.background)
        # OpenGL draws into the thread's current context, which may be another renderer's.
        with self._context:
            staged = self._scenes.get(scene, lambda: self._stage(scene))
            rgb, depth = self._draw(scene, staged, camera)
        visible = visible_joints(staged.joints, depth, camera) if request.truth else None
        if camera.depth_noise == "d435i":
            depth = measure_depth(depth, camera.intrinsics.fx, noise_seed(scene, camera))
        return Frame(
            rgb=rgb,
            depth=depth,
            camera=camera,
            joints=staged.joints.copy() if request.truth else None,
            visible=visible,
            timings={"render": time.perf_counter() - started},
        )

    def close(self) -> None:
        """Give back the context and everything in it."""
        self._context.release()

    def _program(self, vertex: str, fragment: str) -> Any:
        sources = importlib.resources.files("render_worker") / "shaders"
        return self._context.program(
            vertex_shader=(sources / f"{vertex}.vert").read_text(),
            fragment_shader=(sources / f"{fragment}.frag").read_text(),
        )

    def _stage(self, scene: Scene) -> _Staged:
        person = place_person(dress(self._assets, scene), scene)
        light = light_of(scene)
        vertices = self._context.buffer(person.corners.tobytes())
        attributes = (vertices, "3f 3f 3f 3f", "position", "normal", "uv", "cut")
        casting = (vertices, "3f 24x 3f", "position", "cut")
        indices = [self._context.buffer(triangles.tobytes()) for triangles in (person.closed, person.open)]
        closed, opened = (self._context.vertex_array(self._person, [attributes], index) for index in indices)
        shadow = self._shadow(light, [self._context.vertex_array(self._caster, [casting], index) for index in indices])
        extent = self._ground_texture(scene.ground)[1]
        patch = self._patch(scene, extent)
        bands = self._bands(scene, extent, light.lit_shade)
        textures = self._person_textures(person)
        resources = (vertices, *indices, closed, opened, shadow, *patch[1:], *bands[1:], textures)
        return _Staged(
            closed=closed,
            open=opened,
            patch=patch[0],
            bands=bands[0],
            textures=textures,
            shadow=shadow,
            light=light,
            joints=place_joints(person.joints, scene),
            resources=resources,
        )

    def _person_textures(self, person: Person) -> Any:
        count, rows, columns = person.textures.shape[:3]
        textures = self._context.texture_array((columns, rows, count), 3, person.textures.tobytes(), alignment=1)
        _smooth(textures)
        return textures

    def _shadow(self, light: Light, casters: list[Any]) -> Any:
        """Depth of the person as seen from the sun."""
        shadow = self._context.depth_texture((_SHADOW_SIZE, _SHADOW_SIZE))
        shadow.compare_func = "<="
        shadow.repeat_x = shadow.repeat_y = False
        framebuffer = self._context.framebuffer(depth_attachment=shadow)
        framebuffer.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        framebuffer.clear(depth=1.0)
        self._caster["light"].write(_uniform(light.view))
        for caster, edges in zip(casters, (False, True), strict=True):
            self._caster["edges"].value = edges
            caster.render()
            caster.release()
        framebuffer.release()
        return shadow

    def _patch(self, scene: Scene, extent: float) -> tuple[Any, ...]:
        corners, triangles = ground_patch(scene.position, SHADOW_REACH, extent)
        buffers = self._context.buffer(corners.tobytes()), self._context.buffer(triangles.tobytes())
        array = self._context.vertex_array(self._ground, [(buffers[0], "3f 2f", "position", "uv")], buffers[1])
        return array, *buffers, array

    def _bands(self, scene: Scene, extent: float, shade: float) -> tuple[Any, ...]:
        hall = is_hall(scene.background)
        corners, triangles = ground_bands(scene.position, SHADOW_REACH, extent, shade, hall=hall)
        return self._surface(corners, triangles)

    def _surface(self, corners: Float32Array, triangles: Any) -> tuple[Any, ...]:
        buffers = self._context.buffer(corners.tobytes()), self._context.buffer(triangles.tobytes())
        attributes = (buffers[0], "3f 2f 1f 1f", "position", "uv", "shade", "haze")
        array = self._context.vertex_array(self._shell, [attributes], buffers[1])
        return array, *buffers, array

    def _ground_texture(self, name: str) -> tuple[Any, float]:
        def make() -> tuple[Any, float]:
            ground = make_ground(name, self._assets.photographs)
            return self._texture(ground.image), ground.extent

        return self._grounds.get(name, make)

    def _shell_pictures(self, background: str) -> tuple[_Picture, ...]:
        def make() -> tuple[_Picture, ...]:
            made: list[_Picture] = []
            for shell in make_shells(background, self._assets.photographs):
                array, *buffers = self._surface(shell.corners, shell.triangles)
                texture = self._texture(shell.image)
                made.append(_Picture(array, texture, shell.solid, (*buffers, texture)))
            return tuple(made)

        return self._shells.get(background, make)

    def _texture(self, image: UInt8Array) -> Any:
        rows, columns = image.shape[:2]
        texture = self._context.texture((columns, rows), 3, image.tobytes(), alignment=1)
        _smooth(texture)
        return texture

    def _draw(self, scene: Scene, staged: _Staged, camera: Camera) -> tuple[UInt8Array, Float32Array]:
        """Nearest first, so that what is hidden is not shaded."""
        shells, (ground, _) = self._shell_pictures(scene.background), self._ground_texture(scene.ground)
        target = self._target(camera.intrinsics)
        view = _uniform(_projection(camera.intrinsics) @ world_to_camera(camera.pose))
        target.framebuffer.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        target.framebuffer.clear(*staged.light.air, 1.0)
        self._draw_person(staged, view)
        self._draw_ground(staged, ground, view)
        for shell in shells:
            target.framebuffer.depth_mask = shell.solid
            shell.texture.use(0)
            shell.array.render()
        target.framebuffer.depth_mask = True
        return self._read(target, camera.intrinsics)

    def _draw_person(self, staged: _Staged, view: bytes) -> None:
        program, light = self._person, staged.light
        # The picture is drawn upside down, so that outsides are clockwise.
        self._context.front_face = "cw"
        self._context.enable(self._context.CULL_FACE)
        staged.textures.use(0)
        staged.shadow.use(1)
        program["textures"].value, program["shadow"].value = 0, 1
        program["view_projection"].write(view)
        program["light"].write(_uniform(light.view))
        program["towards_sun"].value = light.towards_sun
        program["sun"].value, program["sky"].value, program["bounce"].value = light.sun, light.sky, light.bounce
        program["edges"].value = False
        staged.closed.render()
        self._context.disable(self._context.CULL_FACE)
        program["edges"].value = True
        staged.open.render()

    def _draw_ground(self, staged: _Staged, ground: Any, view: bytes) -> None:
        ground.use(0)
        staged.shadow.use(1)
        self._ground["image"].value, self._ground["shadow"].value = 0, 1
        self._ground["view_projection"].write(view)
        self._ground["light"].write(_uniform(staged.light.view))
        self._ground["lit_shade"].value = staged.light.lit_shade
        self._ground["shadow_shade"].value = staged.light.shadow_shade
        staged.patch.render()
        self._shell["image"].value = 0
        self._shell["air"].value = staged.light.air
        self._shell["view_projection"].write(view)
        staged.bands.render()

    def _target(self, intrinsics: Intrinsics) -> _Target:
        size = (intrinsics.width, intrinsics.height)

        def make() -> _Target:
            colour, depth = self._context.renderbuffer(size, 4), self._context.depth_renderbuffer(size)
            framebuffer = self._context.framebuffer([colour], depth)
            return _Target(framebuffer, (framebuffer, colour, depth))

        return self._targets.get(size, make)

    def _read(self, target: _Target, intrinsics: Intrinsics) -> tuple[UInt8Array, Float32Array]:
        size = (intrinsics.height, intrinsics.width)
        pixels = np.frombuffer(target.framebuffer.read(components=4, alignment=1), np.uint8).reshape(*size, 4)
        stored = np.frombuffer(
            target.framebuffer.read(attachment=-1, components=1, dtype="f4", alignment=1), np.float32
        )
        return cv2.cvtColor(pixels, cv2.COLOR_RGBA2RGB).astype(np.uint8, copy=False), _metres(stored.reshape(size))


def _open_context(threads: int) -> Any:
    # Mesa reads it when the context is made.
    os.environ["LP_NUM_THREADS"] = str(threads)
    import moderngl

    settings: Any = {"backend": "egl"}
    try:
        return moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:
        raise Unavailable(
            f"no OpenGL 3.3 through EGL on this machine ({error}); on Debian: apt install libegl1 libgl1-mesa-dri"
        ) from error


def _smooth(texture: Any) -> None:
    import moderngl

    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)


def _projection(intrinsics: Intrinsics) -> Float64Array:
    """Camera coordinates to OpenGL's clip space, the image's first row at the bottom, where reading starts."""
    width, height = intrinsics.width, intrinsics.height
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[0, 2] = 2 * intrinsics.fx / width, (2 * intrinsics.cx + 1) / width - 1
    matrix[1, 1], matrix[1, 2] = 2 * intrinsics.fy / height, (2 * intrinsics.cy + 1) / height - 1
    matrix[2, 2] = (_CLIPPED + NEAREST) / (_CLIPPED - NEAREST)
    matrix[2, 3] = -2 * _CLIPPED * NEAREST / (_CLIPPED - NEAREST)
    matrix[3, 2] = 1
    return matrix


def _metres(stored: Float32Array) -> Float32Array:
    """The depth buffer's values as metres along the view; 0 where there is nothing but sky."""
    scale = (_CLIPPED - NEAREST) / (_CLIPPED * NEAREST)
    depth = np.reciprocal(np.float32(1 / NEAREST) - stored * np.float32(scale), dtype=np.float32)
    depth[stored >= 1] = 0
    return depth


def _uniform(matrix: Float64Array) -> bytes:
    return matrix.T.astype(np.float32).tobytes()


def _release(value: _Staged | _Target) -> None:
    for resource in value.resources:
        resource.release()


def _release_all(pictures: tuple[_Picture, ...]) -> None:
    for picture in pictures:
        for resource in picture.resources:
            resource.release()


def _release_ground(ground: tuple[Any, float]) -> None:
    ground[0].release()
