"""Drawing a frame of a scene that is staged: one pass, nearest first, so that what is hidden is not shaded."""

from typing import TYPE_CHECKING

from protocol.camera import Camera, world_to_camera
from protocol.region import Region
from render_worker.opengl.picture import clip_projection, rectangle, uniform
from render_worker.opengl.staging import Backdrop, Ground, Programs, Staged

if TYPE_CHECKING:
    from moderngl import Context, Framebuffer


class Drawing:
    """Draws staged scenes with the programs that they were staged for."""

    def __init__(self, context: "Context", programs: Programs) -> None:
        self._context = context
        self._programs = programs

    def draw(
        self,
        target: "Framebuffer",
        staged: Staged,
        ground: Ground,
        backdrops: tuple[Backdrop, ...],
        camera: Camera,
        region: Region,
    ) -> None:
        """Draw a region of what a camera sees; outside of it the target is left as it may be."""
        view = uniform(clip_projection(camera.intrinsics) @ world_to_camera(camera.pose))
        # The whole picture's view, cut: a view of the part alone would round its corners otherwise.
        target.scissor = rectangle(region)
        target.use()
        self._context.enable_only(self._context.DEPTH_TEST)
        target.clear(*staged.light.air, 1.0)
        self._draw_people(staged, view)
        self._draw_patch(staged, ground, view)
        self._draw_surroundings(target, staged, backdrops, view)

    def _draw_people(self, staged: Staged, view: bytes) -> None:
        program, light = self._programs.person, staged.light
        staged.shadow.use(1)
        program["shadow"].value = 1
        program["view_projection"].write(view)
        program["light"].write(uniform(light.view))
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

    def _draw_patch(self, staged: Staged, ground: Ground, view: bytes) -> None:
        """The ground around the people; its texture stays in use for the ground beyond."""
        program = self._programs.ground
        ground.texture.use(0)
        staged.shadow.use(1)
        program["shadow"].value = 1
        program["view_projection"].write(view)
        program["light"].write(uniform(staged.light.view))
        program["lit_shade"].value = staged.light.lit_shade
        program["shadow_shade"].value = staged.light.shadow_shade
        staged.patch.render()

    def _draw_surroundings(
        self, target: "Framebuffer", staged: Staged, backdrops: tuple[Backdrop, ...], view: bytes
    ) -> None:
        program = self._programs.surroundings
        program["view_projection"].write(view)
        program["air"].value = staged.light.air
        staged.bands.render()
        for backdrop in backdrops:
            target.depth_mask = backdrop.solid
            backdrop.texture.use(0)
            backdrop.array.render()
        target.depth_mask = True
