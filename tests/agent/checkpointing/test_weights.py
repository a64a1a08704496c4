import numpy as np
import pytest

from agent.checkpointing.weights import load_weights, save_weights
from protocol.errors import ArtifactDamaged, ArtifactMissing


def test_weights_come_back_as_they_were(tmp_path) -> None:
    weights = {"policy.net.0.weight": np.arange(6, dtype=np.float32).reshape(2, 3), "bias": np.ones(1, np.float32)}
    save_weights(tmp_path / "w.safetensors", weights, {"algorithm": "sac", "steps": "40"})
    loaded, about = load_weights(tmp_path / "w.safetensors")
    assert about == {"algorithm": "sac", "steps": "40"}
    assert loaded.keys() == weights.keys()
    for name, array in weights.items():
        assert np.array_equal(loaded[name], array)


def test_weights_that_are_not_there_say_how_to_make_them(tmp_path) -> None:
    with pytest.raises(ArtifactMissing, match="orchestrator train"):
        load_weights(tmp_path / "w.safetensors")


@pytest.mark.parametrize("keep", [0, 7, 100, -1])
def test_weights_cut_off_are_refused(tmp_path, keep: int) -> None:
    path = tmp_path / "w.safetensors"
    save_weights(path, {"a": np.zeros(50, np.float32)}, {})
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(ArtifactDamaged):
        load_weights(path)


def test_weights_before_stand_until_the_new_ones_are_whole(tmp_path) -> None:
    path = tmp_path / "w.safetensors"
    save_weights(path, {"a": np.zeros(2, np.float32)}, {})
    with pytest.raises(AttributeError):
        save_weights(path, {"a": "no array"}, {})  # pyright: ignore[reportArgumentType]
    assert load_weights(path)[0]["a"].tolist() == [0.0, 0.0]
    assert [file.name for file in tmp_path.iterdir()] == ["w.safetensors"]
