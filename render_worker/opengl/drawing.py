"""Drawing a frame of a scene that is staged: one pass, nearest first, so that what is hidden is not shaded."""

from typing import TYPE_CHECKING, NamedTuple

from protocol.arrays import Float64Array
from protocol.camera import Camera, Intrinsics, world_to_camera
from protocol.region import Region
from render_worker.opengl.picture import clip_projection, rectangle, uniform
from render_worker.opengl.shadowed import shadowed_region
from render_worker.opengl.staging import Backdrop, Ground, Programs, Staged, Uploaded
from render_worker.surroundings.light import Light

if TYPE_CHECKING:
    from moderngl import Context, Framebuffer


class View(NamedTuple):
    """The camera's view of a frame, and the target that it is drawn on.

    Attributes:
        clip: (4, 4) world to clip space.
        region: the part that is drawn; the target outside of it is undefined.
    """

    target: "Framebuffer"
    intrinsics: Intrinsics
    clip: Float64Array
    region: Region

    @classmethod
    def of(cls, target: "Framebuffer", camera: Camera, region: Region) -> "View":
        """A region of a camera's picture."""
        clip = clip_projection(camera.intrinsics) @ world_to_camera(camera.pose)
        return cls(target, camera.intrinsics, clip, region)

    def cut(self, region: Region) -> None:
        """Draw a region of the target alone, of the same view: a view of the part would round otherwise."""
        self.target.scissor = rectangle(region)
        self.target.use()

    def clear(self, light: Light) -> None:
        """Before anything is drawn there is haze, infinitely far away."""
        whole = Region.seen_by(self.intrinsics)
        # Software clears a target by memory, but a part of it pixel by pixel: that takes four times as long.
        by_memory = 4 * self.region.width * self.region.height > whole.width * whole.height
        self.cut(whole if by_memory else self.region)
        self.target.clear(*light.air, 1.0)
        self.cut(self.region)


class Drawing:
    """Draws staged scenes with the programs that they were staged for."""

    def __init__(self, context: "Context", programs: Programs) -> None:
        self._context = context
        self._programs = programs

    def draw(self, view: View, staged: Staged, ground: Ground, backdrops: tuple[Backdrop, ...]) -> None:
        """Draw a scene."""
        self._context.enable_only(self._context.DEPTH_TEST)
        view.clear(staged.light)
        self._draw_people(view, staged)
        self._draw_patch(view, staged, ground)
        self._draw_surroundings(view, staged, backdrops)

    def _draw_people(self, view: View, staged: Staged) -> None:
        program, light = self._programs.person, staged.light
        staged.shadow.use(1)
        program["shadow"].value = 1
        program["view_projection"].write(uniform(view.clip))
        program["light"].write(uniform(light.view))
        program["towards_sun"].value = light.towards_sun
        program["sun"].value, program["sky"].value, program["bounce"].value = light.sun, light.sky, light.bounce
        # The picture is drawn upside down, so that outsides are clockwise.
        self._context.front_face = "cw"
        for one in staged.people:
            if one.outline.may_show(view.clip, view.intrinsics, view.region):
                self._draw_person(one, first=one is staged.people[0])

    def _draw_person(self, one: Uploaded, *, first: bool) -> None:
        program, context = self._programs.person, self._context
        one.textures.use(0)
        context.enable(context.CULL_FACE)
        # The first of the people is drawn from the last triangle to the first: hair and clothes come before the skin
        # under them, which need not be shaded. Where two are equally near, the first one stays either way.
        context.depth_func = "<=" if first else "<"
        program["edges"].value = False
        one.closed.render()
        context.depth_func = "<"
        context.disable(context.CULL_FACE)
        program["edges"].value = True
        one.open.render()

    def _draw_patch(self, view: View, staged: Staged, ground: Ground) -> None:
        """The ground around the people; its texture stays in use for the ground beyond."""
        ground.texture.use(0)
        within = shadowed_region(staged.shadowed, view.clip, view.intrinsics, view.region)
        if within is not None:
            view.cut(within)
            self._draw_shadowed(view, staged)
            view.cut(view.region)
        # What was drawn is as near as what comes now, and stays.
        program = self._programs.lit_ground
        program["view_projection"].write(uniform(view.clip))
        program["lit_shade"].value = staged.light.lit_shade
        staged.lit_patch.render()

    def _draw_shadowed(self, view: View, staged: Staged) -> None:
        program, light = self._programs.ground, staged.light
        staged.shadow.use(1)
        program["shadow"].value = 1
        program["view_projection"].write(uniform(view.clip))
        program["light"].write(uniform(light.view))
        program["lit_shade"].value, program["shadow_shade"].value = light.lit_shade, light.shadow_shade
        staged.patch.render()

    def _draw_surroundings(self, view: View, staged: Staged, backdrops: tuple[Backdrop, ...]) -> None:
        program = self._programs.surroundings
        program["view_projection"].write(uniform(view.clip))
        program["air"].value = staged.light.air
        staged.bands.render()
        for backdrop in backdrops:
            view.target.depth_mask = backdrop.solid
            backdrop.texture.use(0)
            backdrop.array.render()
        view.target.depth_mask = True
