import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from perception_worker.next_view.arrays import CENTRE, read_arrays
from protocol.errors import InvalidInput

LISTS = {
    "person": 2,
    "intrinsics": 4,
    "camera": 6,
    "keypoints": 36,
    "points": 54,
    "height": 18,
    "quality": 18,
    "narrow": 126,
    "wide": 126,
    "joints": 54,
}
CELLS = [(column, row) for row in (1, 0, -1) for column in (-1, 0, 1)]


def written(folder, splits=("test", "train"), cells=CELLS):
    """A table of one scene for each split; a number in a list tells its row."""
    rows = [(split, *cell) for split in splits for cell in cells]
    columns = {name: [row[place] for row in rows] for place, name in enumerate(("split", "column", "row"))}
    scalars = {"scene": list(range(len(rows))), "yaw": [0.1 * row for row in range(len(rows))]}
    pictures = {"picture": [b"jpeg" if row[1:] == (0, 0) else None for row in rows]}
    lists = {
        name: pa.FixedSizeListArray.from_arrays(
            pa.array(np.repeat(np.arange(len(rows), dtype=np.float32), count)), count
        )
        for name, count in LISTS.items()
    }
    pq.write_table(pa.table(columns | scalars | pictures | lists), folder / "views.parquet")
    return folder / "views.parquet"


def test_a_scene_has_its_nine_views_in_order_and_its_own_values_from_the_centre(tmp_path):
    arrays = read_arrays(written(tmp_path))
    assert arrays.is_train.tolist() == [False, True]
    assert arrays.scene.tolist() == [CENTRE, 9 + CENTRE]
    assert arrays.quality[1, :, 0].tolist() == list(range(9, 18))
    assert arrays.joints[1, 0, 0] == 9 + CENTRE
    assert arrays.pictures == (b"jpeg", b"jpeg")


def test_uncertainty_is_that_of_the_upper_body(tmp_path):
    arrays = read_arrays(written(tmp_path))
    arrays.quality[:] = 1.0
    arrays.quality[0, 2, 0], arrays.quality[0, 3, 9] = 0.5, 0.0
    # The nose has weight 2, a knee none.
    assert arrays.uncertainty[0] == pytest.approx([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"cells": CELLS[:-1]}, "lacks a camera"),
        ({"cells": CELLS[::-1]}, "another order"),
        ({"splits": ("train",)}, "train alone"),
    ],
    ids=["a camera is missing", "another order", "no test split"],
)
def test_a_table_that_is_not_whole_is_refused(tmp_path, wrong, words):
    with pytest.raises(InvalidInput, match=words):
        read_arrays(written(tmp_path, **wrong))


def test_another_file_is_refused(tmp_path):
    (tmp_path / "other").write_text("no table")
    with pytest.raises(InvalidInput, match="next-view"):
        read_arrays(tmp_path / "other")
