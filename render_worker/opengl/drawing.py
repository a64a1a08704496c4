"""Drawing a frame of a scene that is staged: one pass, nearest first, so that what is hidden is not shaded."""

from typing import TYPE_CHECKING

from protocol.camera import Camera, world_to_camera
from protocol.region import Region
from render_worker.light import Light
from render_worker.opengl.picture import clip_projection, rectangle, uniform
from render_worker.opengl.shadowed import shadowed_region
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
        clip = clip_projection(camera.intrinsics) @ world_to_camera(camera.pose)
        view, shadowed = uniform(clip), shadowed_region(staged.shadowed, clip, camera.intrinsics, region)
        self._context.enable_only(self._context.DEPTH_TEST)
        self._clear(target, region, staged.light)
        self._draw_people(staged, view)
        self._draw_patch(target, staged, ground, view, region, shadowed)
        self._draw_surroundings(target, staged, backdrops, view)

    def _clear(self, target: "Framebuffer", region: Region, light: Light) -> None:
        # Software clears a target by memory, but a part of it pixel by pixel: that takes four times as long.
        whole = Region.whole(target.height, target.width)
        _cut(target, region if 4 * region.width * region.height < whole.width * whole.height else whole)
        target.clear(*light.air, 1.0)
        _cut(target, region)

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
            # The first of the people is drawn from the last triangle to the first: hair and clothes come before the
            # skin under them, which need not be shaded. Where two are equally near, the first one stays either way.
            self._context.depth_func = "<=" if one is staged.people[0] else "<"
            program["edges"].value = False
            one.closed.render()
            self._context.depth_func = "<"
            self._context.disable(self._context.CULL_FACE)
            program["edges"].value = True
            one.open.render()

    def _draw_patch(
        self,
        target: "Framebuffer",
        staged: Staged,
        ground: Ground,
        view: bytes,
        region: Region,
        shadowed: Region | None,
    ) -> None:
        """The ground around the people; its texture stays in use for the ground beyond."""
        shaded, lit = self._programs.ground, self._programs.lit_ground
        ground.texture.use(0)
        staged.shadow.use(1)
        shaded["shadow"].value = 1
        shaded["view_projection"].write(view)
        shaded["light"].write(uniform(staged.light.view))
        shaded["lit_shade"].value = staged.light.lit_shade
        shaded["shadow_shade"].value = staged.light.shadow_shade
        if shadowed is not None:
            _cut(target, shadowed)
            staged.patch.render()
            _cut(target, region)
        # What was drawn is as near as what comes now, and stays.
        lit["view_projection"].write(view)
        lit["lit_shade"].value = staged.light.lit_shade
        staged.lit_patch.render()

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


def _cut(target: "Framebuffer", region: Region) -> None:
    """Draw a region of the target alone. It is the whole picture's view, cut: a view of the part would be rounded."""
    target.scissor = rectangle(region)
    target.use()
