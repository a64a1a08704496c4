"""A scene on the GPU: bodies, ground, surroundings and shadow, uploaded before its first frame."""

from typing import TYPE_CHECKING, Any, NamedTuple

from protocol.arrays import AnyArray, Float32Array, Float64Array, UInt8Array
from render_worker.arrays import IndexArray
from render_worker.assets import Assets
from render_worker.opengl.outline import Outline
from render_worker.opengl.picture import uniform
from render_worker.opengl.prepared import PreparedScene
from render_worker.opengl.texture_arrays import TextureArrays
from render_worker.people.person import Person
from render_worker.surroundings.light import Light
from render_worker.surroundings.surroundings import make_ground, make_shells

if TYPE_CHECKING:
    from moderngl import Buffer, Context, Texture, TextureArray, VertexArray

_SHADOW_SIZE = 1024


class Programs(NamedTuple):
    """The shaders' programs, each by its files' name."""

    person: Any
    shadow: Any
    ground: Any
    lit_ground: Any
    surroundings: Any


class Uploaded(NamedTuple):
    """A person on the GPU.

    Attributes:
        closed, open: their surfaces.
        casters: the same as the sun sees them.
        outline: the box around all of them.
    """

    closed: "VertexArray"
    open: "VertexArray"
    casters: "tuple[VertexArray, VertexArray]"
    textures: "TextureArray"
    outline: Outline


class Staged(NamedTuple):
    """A scene's own things on the GPU, and the person's true joints in the world frame.

    Attributes:
        patch, lit_patch: the ground around the people, to be drawn with their shadow and without.
        shadowed: where shadow can fall, as `shadowed_ground` tells.
    """

    people: tuple[Uploaded, ...]
    patch: "VertexArray"
    lit_patch: "VertexArray"
    shadowed: Float64Array | None
    bands: "VertexArray"
    shadow: "Texture"
    light: Light
    joints: Float64Array


class Ground(NamedTuple):
    """A ground's image on the GPU, `extent` metres wide."""

    texture: "Texture"
    extent: float


class Backdrop(NamedTuple):
    """One of the surfaces around a scene, on the GPU; `solid` if it has a distance."""

    array: "VertexArray"
    texture: "Texture"
    solid: bool


class Staging:
    """Uploads scenes and what is around them."""

    def __init__(self, context: "Context", programs: Programs, assets: Assets) -> None:
        self._context = context
        self._programs = programs
        self._assets = assets
        self._texture_arrays = TextureArrays(context)

    def scene(self, prepared: PreparedScene) -> Staged:
        """The things that belong to this scene alone."""
        people = tuple(map(self._upload, prepared.people))
        around = self._buffer(prepared.patch[0]), self._buffer(prepared.patch[1])
        return Staged(
            people=people,
            patch=self._array(self._programs.ground, *around, "3f 2f", "position", "uv"),
            lit_patch=self._array(self._programs.lit_ground, *around, "3f 2f", "position", "uv"),
            shadowed=prepared.shadowed,
            bands=self._shell_array(*prepared.bands),
            shadow=self._shadow(prepared.light, people),
            light=prepared.light,
            joints=prepared.joints,
        )

    def ground(self, name: str) -> Ground:
        """A ground's image; many scenes have it."""
        ground = make_ground(name, self._assets.photographs)
        return Ground(self._texture(ground.image), ground.extent)

    def backdrops(self, background: str) -> tuple[Backdrop, ...]:
        """A sky, or walls and a ceiling; many scenes have them."""
        return tuple(
            Backdrop(self._shell_array(shell.corners, shell.triangles), self._texture(shell.image), shell.solid)
            for shell in make_shells(background, self._assets.photographs)
        )

    def _upload(self, person: Person) -> Uploaded:
        vertices, closed, opened = map(self._buffer, (person.corners, person.closed, person.open))
        seen = ("3f 3f 3f 3f", "position", "normal", "uv", "cut")
        casting = ("3f 24x 3f", "position", "cut")
        return Uploaded(
            closed=self._array(self._programs.person, vertices, closed, *seen),
            open=self._array(self._programs.person, vertices, opened, *seen),
            casters=(
                self._array(self._programs.shadow, vertices, closed, *casting),
                self._array(self._programs.shadow, vertices, opened, *casting),
            ),
            textures=self._texture_arrays.make(person.textures),
            outline=Outline(person.corners[:, :3]),
        )

    def _shadow(self, light: Light, people: tuple[Uploaded, ...]) -> "Texture":
        """Depth of the people as seen from the sun."""
        program = self._programs.shadow
        shadow = self._context.depth_texture((_SHADOW_SIZE, _SHADOW_SIZE))
        shadow.compare_func = "<="
        shadow.repeat_x = shadow.repeat_y = False
        framebuffer = self._context.framebuffer(depth_attachment=shadow)
        framebuffer.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        framebuffer.clear(depth=1.0)
        program["light"].write(uniform(light.view))
        for one in people:
            for caster, edges in zip(one.casters, (False, True), strict=True):
                program["edges"].value = edges
                caster.render()
        return shadow

    def _buffer(self, values: AnyArray) -> "Buffer":
        return self._context.buffer(values.tobytes())

    def _array(self, program: Any, corners: "Buffer", triangles: "Buffer", *layout: str) -> "VertexArray":
        return self._context.vertex_array(program, [(corners, *layout)], triangles)

    def _shell_array(self, corners: Float32Array, triangles: IndexArray) -> "VertexArray":
        layout = ("3f 2f 1f 1f", "position", "uv", "shade", "haze")
        return self._array(self._programs.surroundings, self._buffer(corners), self._buffer(triangles), *layout)

    def _texture(self, image: UInt8Array) -> "Texture":
        rows, columns = image.shape[:2]
        texture = self._context.texture((columns, rows), 3, image.tobytes(), alignment=1)
        _smooth(texture)
        return texture


def _smooth(texture: "Texture") -> None:
    import moderngl

    texture.build_mipmaps()
    texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
