import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from orchestrator.experiments.list_columns import numbers, table_with
from orchestrator.experiments.next_view.page import page
from orchestrator.experiments.next_view.plot import scores_plot
from orchestrator.experiments.next_view.scores import scenes_of, scores_of
from protocol.errors import DamagedRecord
from protocol.skeleton import JOINT_COUNT

VIEWS = pa.schema(
    [
        pa.field("split", pa.string()),
        pa.field("identity", pa.int16()),
        pa.field("quality", numbers(JOINT_COUNT)),
    ]
)
CHOICES = pa.schema(
    [
        pa.field("group", pa.string()),
        pa.field("method", pa.string()),
        pa.field("seed", pa.int16()),
        pa.field("split", pa.string()),
        pa.field("expected", numbers(8)),
    ]
)
SCENES = {
    # The centre has 5. The first camera has 4 and the second 4.05, the others 6.
    "first": (4.0, 4.05, 6.0, 6.0, 5.0, 6.0, 6.0, 6.0, 6.0),
    "last": (6.0, 6.0, 6.0, 6.0, 5.0, 6.0, 6.0, 6.0, 2.0),
    "nobody": (10.0,) * 9,
}
FIRST, SECOND, LAST = (-np.eye(8)[camera] for camera in (0, 1, 7))


def written(folder, scenes, choices):
    """A table of scenes (split, identity, name) and one of choices (method, seed, split, expected)."""
    rows = [(split, identity, one) for split, identity, name in scenes for one in SCENES[name]]
    columns = {
        "split": [split for split, _, _ in rows],
        "identity": [identity for _, identity, _ in rows],
        "quality": [np.full(JOINT_COUNT, 1 - one / 10) for _, _, one in rows],
    }
    pq.write_table(table_with(VIEWS, columns), folder / "views.parquet")
    told = {name: [one[place] for one in choices] for place, name in enumerate(("method", "seed", "split", "expected"))}
    pq.write_table(table_with(CHOICES, told | {"group": ["map"] * len(choices)}), folder / "choices.parquet")
    return folder / "views.parquet", folder / "choices.parquet"


def test_scores_are_those_computed_by_hand(tmp_path):
    scenes = [("train", 0, "first"), ("train", 1, "last"), ("test", 40, "first"), ("test", 41, "last")]
    choices = [
        ("a", 0, "train", FIRST),
        ("a", 0, "train", FIRST),
        # Right and wrong.
        ("a", 0, "test", FIRST),
        ("a", 0, "test", FIRST),
        ("a", 1, "train", FIRST),
        ("a", 1, "train", LAST),
        # Nearly right and right.
        ("a", 1, "test", SECOND),
        ("a", 1, "test", LAST),
    ]
    scores = scores_of(*written(tmp_path, scenes, choices), spacing=1.0)
    (way,) = scores.ways
    assert (scores.train, scores.test, scores.undecided, scores.people) == (2, 2, 0, 2)
    assert (scores.centre.value, scores.best.value) == pytest.approx((5.0, 3.0))
    # 0.05 below the second, and 4: the lower of the two in the middle.
    assert scores.lead.value == pytest.approx(0.05, abs=1e-5)
    assert scores.best_by_camera == (0.5, 0, 0, 0, 0, 0, 0, 0.5)
    assert scores.chance == 0.875
    assert (way.seeds, way.train_error, way.error.value) == pytest.approx((2, 0.25, 0.5))
    assert (way.lowest_error, way.highest_error) == (0.5, 0.5)
    assert way.near_error.value == pytest.approx(0.25)
    # Chosen: 4, 6 and 4.05, 2, so 0 and 3.95 better than the centre; the best are 4 better.
    assert way.uncertainty.value == pytest.approx((4.0 + 6.0 + 4.05 + 2.0) / 4)
    assert way.share.value == pytest.approx((0.975 + 1.0) / 4, abs=1e-6)


def test_scenes_in_which_no_camera_finds_the_person_are_left_out(tmp_path):
    scenes = [("train", 0, "first"), ("test", 40, "nobody"), ("test", 41, "last")]
    choices = [("a", 0, "train", FIRST), ("a", 0, "test", FIRST), ("a", 0, "test", LAST)]
    scores = scores_of(*written(tmp_path, scenes, choices), spacing=1.0)
    assert (scores.test, scores.undecided, scores.people) == (1, 1, 1)
    assert scores.ways[0].error.value == 0.0


def test_choices_of_other_scenes_are_refused_by_name(tmp_path):
    scenes = [("train", 0, "first"), ("test", 40, "first"), ("test", 41, "last")]
    choices = [("towards the window", 0, "train", FIRST), ("towards the window", 0, "test", FIRST)]
    with pytest.raises(DamagedRecord, match="towards the window"):
        scores_of(*written(tmp_path, scenes, choices), spacing=1.0)


def test_uncertainties_of_a_split_are_in_the_order_of_its_cameras(tmp_path):
    views, _ = written(tmp_path, [("train", 0, "last"), ("test", 40, "first")], [("a", 0, "test", FIRST)])
    found = scenes_of(pq.read_table(views), "test")
    assert found.centre == pytest.approx([5.0], abs=1e-5)
    assert found.around[0] == pytest.approx([4.0, 4.05, 6.0, 6.0, 6.0, 6.0, 6.0, 6.0], abs=1e-5)


def test_a_page_has_the_thesis_s_errors_beside_ours_and_a_plot_has_every_way(tmp_path):
    scenes = [("train", 0, "first"), ("test", 40, "first"), ("test", 41, "last")]
    names = ("joints and quality [72, 64, 8]", "pose and viewpoint")
    choices = [
        (name, 0, split, expected)
        for name, expected in zip(names, (LAST, FIRST), strict=True)
        for split in ("train", "test", "test")
    ]
    scores = scores_of(*written(tmp_path, scenes, choices), spacing=1.0)
    lines = page(scores).splitlines()
    (ours,) = (line for line in lines if line.startswith(f"| {names[0]}"))
    assert "| 1.00 (0.07) | 0.50 [0.00, 1.00] (0.86) |" in ours
    (plain,) = (line for line in lines if line.startswith(f"| {names[1]} |"))
    assert "(" not in plain
    labels = [label.get_text() for label in scores_plot(scores).axes[0].get_yticklabels()]
    assert labels == list(names)
