import logging

import numpy as np
import pytest

from render_worker import bake
from render_worker.assets import assets_path


@pytest.fixture(autouse=True)
def logs_as_they_were():
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:] = handlers
    root.setLevel(level)


def test_a_whole_file_is_not_made_again(monkeypatch):
    monkeypatch.setattr(bake, "bake", lambda output: pytest.fail("baked again"))
    assert bake.main(["--output", str(assets_path())]) == 0


def test_a_damaged_file_is_made_again(tmp_path, monkeypatch):
    path = tmp_path / "bodies.npz"
    path.write_bytes(b"cut off")
    made = []
    monkeypatch.setattr(bake, "bake", made.append)
    assert bake.main(["--output", str(path)]) == 0
    assert made == [path]


def test_force_makes_a_whole_file_again(monkeypatch):
    made = []
    monkeypatch.setattr(bake, "bake", made.append)
    assert bake.main(["--output", str(assets_path()), "--force"]) == 0
    assert made == [assets_path()]


def test_check_only_looks(tmp_path, monkeypatch):
    monkeypatch.setattr(bake, "bake", lambda output: pytest.fail("baked"))
    assert bake.main(["--check", "--output", str(assets_path())]) == 0
    assert bake.main(["--check", "--output", str(tmp_path / "none.npz")]) == 2


def test_an_arm_is_measured_from_shoulder_to_hand():
    chain = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, -0.2, 0]])
    points = np.array([[-0.1, 0, 0], [0.15, 0.05, 0], [0.3, -0.1, 0], [0.3, -0.3, 0]])
    np.testing.assert_allclose(bake.along_chain(points, chain), [0, 0.5, 1.5, 2.5])
