import numpy as np
import pytest

from protocol.errors import ArtifactDamaged, ArtifactMissing
from render_worker.assets import MASKS, PARTS, PHOTOGRAPHS, Assets, assets_path, load_assets, save_assets


def test_a_missing_file_names_the_command_that_makes_it(tmp_path):
    with pytest.raises(ArtifactMissing, match="orchestrator bodies bake"):
        load_assets(tmp_path / "bodies.npz")


@pytest.mark.parametrize("share", [0.0, 0.3, 0.999])
def test_a_file_that_was_cut_off_is_refused(tmp_path, share):
    whole = assets_path().read_bytes()
    path = tmp_path / "bodies.npz"
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ArtifactDamaged, match="orchestrator bodies bake --force"):
        load_assets(path)


def test_a_file_with_a_flipped_byte_is_refused(tmp_path):
    content = bytearray(assets_path().read_bytes())
    content[len(content) // 2] ^= 0xFF
    path = tmp_path / "bodies.npz"
    path.write_bytes(content)
    with pytest.raises(ArtifactDamaged):
        load_assets(path)


def test_a_foreign_archive_is_refused(tmp_path):
    path = tmp_path / "bodies.npz"
    np.savez(path, vertices=np.zeros(3))
    with pytest.raises(ArtifactDamaged):
        load_assets(path)


def test_a_file_of_another_version_is_refused(tmp_path):
    path = tmp_path / "bodies.npz"
    with np.load(assets_path(), allow_pickle=False) as stored:
        np.savez(path, **{**stored, "version": np.array(99)})
    with pytest.raises(ArtifactDamaged, match="99"):
        load_assets(path)


@pytest.mark.slow
def test_what_was_saved_is_loaded_again(tmp_path, assets: Assets):
    path = tmp_path / "bodies.npz"
    save_assets(path, assets)
    again = load_assets(path)
    np.testing.assert_array_equal(again.vertices, assets.vertices)
    np.testing.assert_array_equal(again.rig.weights, assets.rig.weights)
    np.testing.assert_array_equal(again.rig.regressor, assets.rig.regressor)
    np.testing.assert_array_equal(again.parts["skirt"].triangles, assets.parts["skirt"].triangles)
    assert again.rig.parents == assets.rig.parents
    assert again.provenance == assets.provenance
    assert [file.name for file in tmp_path.iterdir()] == ["bodies.npz"]


def test_the_baked_file_is_consistent(assets: Assets):
    count = assets.vertices.shape[1]
    assert assets.vertices.shape == (60, count, 3)
    assert assets.canonical.shape == (count, 3)
    assert assets.rig.regressor.shape == (18, count)
    np.testing.assert_allclose(assets.rig.weights.sum(axis=1), 1, atol=1e-5)
    np.testing.assert_allclose(assets.rig.regressor.sum(axis=1), 1, atol=1e-4)
    assert all(parent < bone for bone, parent in enumerate(assets.rig.parents))
    for name in PARTS:
        part = assets.parts[name]
        assert part.triangles.max() < len(part.source) == len(part.uv)
        assert part.source.max() < count
    assert set(assets.masks) == set(MASKS)
    assert set(assets.photographs) == set(PHOTOGRAPHS)


def test_our_skinning_agreed_with_the_source_when_it_was_baked(assets: Assets):
    assert assets.provenance["skinning_error_metres"] < 1e-4


def test_half_of_the_identities_are_women_in_either_split(assets: Assets):
    women = [phenotype["gender"] > 0.5 for phenotype in assets.provenance["phenotypes"]]
    assert sum(women[:40]) == 20
    assert sum(women[40:]) == 10
