"""The default renderer: OpenGL through EGL, on a GPU or on Mesa's llvmpipe.

What doesn't change between the frames of a scene (the posed and clothed body, its textures, its shadow) is uploaded
once and kept for the scenes used last; that saves time and changes no byte.
"""

import importlib.resources
import os
import time
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from protocol.arrays import Float32Array, Float64Array, UInt8Array
from protocol.camera import Camera, world_to_camera
from protocol.errors import Unavailable
from protocol.frame import Frame
from protocol.messages import Render
from protocol.region import Region
from protocol.scene import Figure, Scene
from render_worker.arrays import IndexArray
from render_worker.assets import Assets
from render_worker.gl_finish import finish_function
from render_worker.light import Light, light_of
from render_worker.person import Person, dress
from render_worker.picture import NEAREST, clip_projection, read_colours, read_depth
from render_worker.placing import place_joints, place_person
from render_worker.stereo_noise import measure_part, noise_seed, seen_around
from render_worker.surroundings import (
    ground_bands,
    ground_patch,
    is_hall,
    make_ground,
    make_shells,
    require_names,
)
from render_worker.visibility import visible_joints, with_joints

if TYPE_CHECKING:
    from moderngl import Context, Framebuffer, Texture, TextureArray, VertexArray

_SHADOW_SIZE = 1024
_SURROUNDINGS_KEPT = 12
_SIZES_KEPT = 4


class _Uploaded(NamedTuple):
    """Somebody on the GPU; `casters` are their closed and open surfaces as the sun sees them."""

    closed: "VertexArray"
    open: "VertexArray"
    casters: "tuple[VertexArray, VertexArray]"
    textures: "TextureArray"


class _Staged(NamedTuple):
    """A scene's own things on the GPU, and the person's true joints in the world frame."""

    people: tuple[_Uploaded, ...]
    patch: "VertexArray"
    bands: "VertexArray"
    shadow: "Texture"
    light: Light
    joints: Float64Array


class _Ground(NamedTuple):
    """A ground's image on the GPU, `extent` metres wide."""

    texture: "Texture"
    extent: float


class _Backdrop(NamedTuple):
    """One of the surfaces around a scene, on the GPU; `solid` if it has a distance."""

    array: "VertexArray"
    texture: "Texture"
    solid: bool


class OpenGlRenderer:
    """Draws scenes with OpenGL 3.3.

    Args:
        assets: the baked bodies.
        threads: of Mesa's software rasteriser, 0 for the calling thread alone; a GPU doesn't care.
        scenes_kept: how many scenes stay uploaded, some 20 MB each.

    Raises:
        Unavailable: there is no EGL, or no OpenGL 3.3 behind it.
    """

    def __init__(self, assets: Assets, *, threads: int = 0, scenes_kept: int = 16) -> None:
        self._assets = assets
        self._context = _open_context(threads)
        self._finish = finish_function()
        self._person = self._program("person")
        self._caster = self._program("shadow")
        self._ground = self._program("ground")
        self._shell = self._program("surroundings")
        # What drops out of a cache is given back to OpenGL by the context's own collection.
        self._staged = lru_cache(scenes_kept)(self._stage)
        self._grounds = lru_cache(_SURROUNDINGS_KEPT)(self._upload_ground)
        self._backdrops = lru_cache(_SURROUNDINGS_KEPT)(self._upload_backdrops)
        self._targets = lru_cache(_SIZES_KEPT)(self._target)

    @property
    def device(self) -> str:
        """What draws, in the driver's words."""
        return str(self._context.info["GL_RENDERER"])

    def render(self, request: Render) -> Frame:
        """Draw one frame; see `Renderer.render`."""
        started = time.perf_counter()
        scene, camera = request.scene, request.camera
        require_names(scene.ground, scene.background)
        region = request.region or Region.seen_by(camera.intrinsics)
        # OpenGL draws into the thread's current context, which may be another renderer's.
        with self._context:
            staged = self._staged(scene)
            drawn = _needed(region, request, staged.joints)
            target = self._draw(scene, staged, camera, drawn)
            rgb, depth = read_colours(target, region), read_depth(target, drawn)
            self._context.gc()
        visible = visible_joints(staged.joints, depth, camera, drawn) if request.truth else None
        return Frame(
            rgb=rgb,
            depth=_measured(depth, drawn, region, request),
            camera=camera,
            joints=staged.joints.copy() if request.truth else None,
            visible=visible,
            timings={"render": time.perf_counter() - started},
            region=request.region,
        )

    def close(self) -> None:
        """Give back the context and everything in it."""
        for cache in (self._staged, self._grounds, self._backdrops, self._targets):
            cache.cache_clear()
        self._context.release()

    def _program(self, name: str) -> Any:
        sources = importlib.resources.files("render_worker") / "shaders"
        return self._context.program(
            vertex_shader=(sources / f"{name}.vert").read_text(),
            fragment_shader=(sources / f"{name}.frag").read_text(),
        )

    def _stage(self, scene: Scene) -> _Staged:
        light, extent, hall = light_of(scene), self._grounds(scene.ground).extent, is_hall(scene.background)
        person = dress(self._assets, scene.person)
        bystanders = [self._upload(dress(self._assets, one), one) for one in scene.bystanders]
        people = (self._upload(person, scene.person), *bystanders)
        patch, triangles = ground_patch(light.centre, light.reach, extent)
        return _Staged(
            people=people,
            patch=self._array(self._ground, patch, triangles, "3f 2f", "position", "uv"),
            bands=self._shell_array(*ground_bands(light.centre, light.reach, extent, light.lit_shade, hall=hall)),
            shadow=self._shadow(light, people),
            light=light,
            joints=place_joints(person.joints, scene.person),
        )

    def _upload(self, person: Person, figure: Figure) -> _Uploaded:
        vertices = self._context.buffer(place_person(person, figure).corners.tobytes())
        closed, opened = (self._context.buffer(triangles.tobytes()) for triangles in (person.closed, person.open))
        seen = (vertices, "3f 3f 3f 3f", "position", "normal", "uv", "cut")
        casting = (vertices, "3f 24x 3f", "position", "cut")
        return _Uploaded(
            closed=self._context.vertex_array(self._person, [seen], closed),
            open=self._context.vertex_array(self._person, [seen], opened),
            casters=(
                self._context.vertex_array(self._caster, [casting], closed),
                self._context.vertex_array(self._caster, [casting], opened),
            ),
            textures=self._person_textures(person),
        )

    def _person_textures(self, person: Person) -> "TextureArray":
        count, rows, columns = person.textures.shape[:3]
        textures = self._context.texture_array((columns, rows, count), 3, person.textures.tobytes(), alignment=1)
        _smooth(textures)
        return textures

    def _shadow(self, light: Light, people: tuple[_Uploaded, ...]) -> "Texture":
        """Depth of the people as seen from the sun."""
        shadow = self._context.depth_texture((_SHADOW_SIZE, _SHADOW_SIZE))
        shadow.compare_func = "<="
        shadow.repeat_x = shadow.repeat_y = False
        framebuffer = self._context.framebuffer(depth_attachment=shadow)
        framebuffer.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        framebuffer.clear(depth=1.0)
        self._caster["light"].write(_uniform(light.view))
        for one in people:
            for caster, edges in zip(one.casters, (False, True), strict=True):
                self._caster["edges"].value = edges
                caster.render()
        return shadow

    def _array(self, program: Any, corners: Float32Array, triangles: IndexArray, *layout: str) -> "VertexArray":
        vertices, index = self._context.buffer(corners.tobytes()), self._context.buffer(triangles.tobytes())
        return self._context.vertex_array(program, [(vertices, *layout)], index)

    def _shell_array(self, corners: Float32Array, triangles: IndexArray) -> "VertexArray":
        return self._array(self._shell, corners, triangles, "3f 2f 1f 1f", "position", "uv", "shade", "haze")

    def _upload_ground(self, name: str) -> _Ground:
        ground = make_ground(name, self._assets.photographs)
        return _Ground(self._texture(ground.image), ground.extent)

    def _upload_backdrops(self, background: str) -> tuple[_Backdrop, ...]:
        return tuple(
            _Backdrop(self._shell_array(shell.corners, shell.triangles), self._texture(shell.image), shell.solid)
            for shell in make_shells(background, self._assets.photographs)
        )

    def _texture(self, image: UInt8Array) -> "Texture":
        rows, columns = image.shape[:2]
        texture = self._context.texture((columns, rows), 3, image.tobytes(), alignment=1)
        _smooth(texture)
        return texture

    def _target(self, size: tuple[int, int]) -> "Framebuffer":
        return self._context.framebuffer([self._context.renderbuffer(size, 4)], self._context.depth_renderbuffer(size))

    def _draw(self, scene: Scene, staged: _Staged, camera: Camera, region: Region) -> "Framebuffer":
        """Nearest first, so that what is hidden is not shaded; of the picture, nothing outside the region."""
        backdrops, ground = self._backdrops(scene.background), self._grounds(scene.ground)
        target = self._targets((camera.intrinsics.width, camera.intrinsics.height))
        view = _uniform(clip_projection(camera.intrinsics) @ world_to_camera(camera.pose))
        # The whole picture's view, cut: a view of the part alone would round its corners otherwise.
        target.scissor = region.left, region.top, region.width, region.height
        target.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        target.clear(*staged.light.air, 1.0)
        self._draw_people(staged, view)
        self._draw_patch(staged, ground, view)
        self._shell["view_projection"].write(view)
        self._shell["air"].value = staged.light.air
        staged.bands.render()
        for backdrop in backdrops:
            target.depth_mask = backdrop.solid
            backdrop.texture.use(0)
            backdrop.array.render()
        target.depth_mask = True
        self._finish()
        return target

    def _draw_people(self, staged: _Staged, view: bytes) -> None:
        program, light = self._person, staged.light
        staged.shadow.use(1)
        program["shadow"].value = 1
        program["view_projection"].write(view)
        program["light"].write(_uniform(light.view))
        program["towards_sun"].value = light.towards_sun
        program["sun"].value, program["sky"].value, program["bounce"].value = light.sun, light.sky, light.bounce
        # The picture is drawn upside down, so that outsides are clockwise.
        self._context.front_face = "cw"
        for one in staged.people:
            one.textures.use(0)
            self._context.enable(self._context.CULL_FACE)
            program["edges"].value = False
            one.closed.render()
            self._context.disable(self._context.CULL_FACE)
            program["edges"].value = True
            one.open.render()

    def _draw_patch(self, staged: _Staged, ground: _Ground, view: bytes) -> None:
        """The ground around the people; its texture stays in use for the ground beyond."""
        ground.texture.use(0)
        staged.shadow.use(1)
        self._ground["shadow"].value = 1
        self._ground["view_projection"].write(view)
        self._ground["light"].write(_uniform(staged.light.view))
        self._ground["lit_shade"].value = staged.light.lit_shade
        self._ground["shadow_shade"].value = staged.light.shadow_shade
        staged.patch.render()


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


def _smooth(texture: "Texture | TextureArray") -> None:
    import moderngl

    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)


def _needed(region: Region, request: Render, joints: Float64Array) -> Region:
    """The part of the picture that has to be drawn so that all of the answer to the request is known."""
    camera = request.camera
    if camera.depth_noise == "d435i":
        region = seen_around(region, camera.intrinsics, NEAREST)
    return with_joints(region, joints, camera) if request.truth else region


def _measured(depth: Float32Array, drawn: Region, region: Region, request: Render) -> Float32Array:
    """The depth of a region as the request's camera measures it, out of the true depth of all that was drawn."""
    camera = request.camera
    if camera.depth_noise == "none":
        return np.ascontiguousarray(region.within(drawn).part(depth))
    size = camera.intrinsics.height, camera.intrinsics.width
    return measure_part(depth, drawn, region, size, camera.intrinsics.fx, noise_seed(request.scene, camera))


def _uniform(matrix: Float64Array) -> bytes:
    return matrix.T.astype(np.float32).tobytes()
