"""A scene prepared for OpenGL: posed and clothed bodies, the ground around them, their light.

None of it needs OpenGL, so one scene can be prepared while another is drawn.
"""

from typing import NamedTuple

from protocol.arrays import Float32Array, Float64Array
from protocol.scene import Scene
from render_worker.arrays import IndexArray
from render_worker.assets import Assets
from render_worker.opengl.shadowed import shadowed_ground
from render_worker.people.person import Person, dress
from render_worker.people.placing import place_joints, place_person
from render_worker.surroundings.light import Light, light_of
from render_worker.surroundings.surroundings import ground_bands, ground_patch, is_hall


class PreparedScene(NamedTuple):
    """A scene's own things as arrays, in the world frame, metres.

    Attributes:
        people: the person, with the closed surfaces in the order in which they are drawn, and the bystanders.
        patch, bands: corners and triangles of the ground around the people and of what is beyond.
        shadowed: where shadow can fall, as `shadowed_ground` tells.
        joints: (18, 3) the person's true ones.
    """

    people: tuple[Person, ...]
    patch: tuple[Float32Array, IndexArray]
    bands: tuple[Float32Array, IndexArray]
    shadowed: Float64Array | None
    light: Light
    joints: Float64Array


def prepare(assets: Assets, scene: Scene, extent: float) -> PreparedScene:
    """Pose, clothe and place all people of a scene; `extent` is its ground's width in metres."""
    light, hall = light_of(scene), is_hall(scene.background)
    figures = (scene.person, *scene.bystanders)
    dressed = [dress(assets, figure) for figure in figures]
    placed = [place_person(person, figure) for person, figure in zip(dressed, figures, strict=True)]
    patch = ground_patch(light.centre, light.reach, extent)
    return PreparedScene(
        people=(placed[0]._replace(closed=placed[0].closed[::-1]), *placed[1:]),
        patch=patch,
        bands=ground_bands(light.centre, light.reach, extent, light.lit_shade, hall=hall),
        shadowed=shadowed_ground([person.corners[:, :3] for person in placed], patch[0][:, :3], light),
        light=light,
        joints=place_joints(dressed[0].joints, scene.person),
    )
