import numpy as np

from render_worker.assets import PARTS
from render_worker.baking.base_mesh import GROUPS, read_parts

MESH = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0.0 0.0
vt 1.0 0.0
vt 1.0 1.0
vt 0.0 1.0
vt 0.5 0.5
"""


def test_quads_become_triangles_and_a_vertex_on_a_seam_two_corners(tmp_path):
    groups = "".join(f"g {member}\nf 1/1 2/2 3/3 4/4\n" for members in GROUPS.values() for member in members)
    path = tmp_path / "base.obj"
    path.write_text(MESH + groups + "g body\nf 1/5 3/3 4/4\n")
    skin = read_parts(path)["skin"]
    assert len(skin.triangles) == 3
    # Vertex 0 has two places in the texture.
    assert sorted(skin.source.tolist()) == [0, 0, 1, 2, 3]
    corner = skin.triangles[2][0]
    assert skin.source[corner] == 0
    np.testing.assert_array_equal(skin.uv[corner], (0.5, 0.5))


def test_the_parts_read_are_those_that_the_baked_file_holds():
    assert tuple(GROUPS) == PARTS
