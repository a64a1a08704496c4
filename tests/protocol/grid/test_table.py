import msgspec
import numpy as np
import pytest
from msgspec.structs import replace

from protocol.errors import ArtifactDamaged
from protocol.grid.table import (
    CELLS,
    LENGTHS,
    QUANTITIES,
    SHARES,
    cell_of,
    read_stored_table,
    read_table,
    stored_numbers,
    stored_place,
    write_table,
)
from protocol.skeleton import JOINT_COUNT
from tests.protocol.grid.tables import place_to_test, quantities, recipe, train_place

TRUTH = np.arange(54, dtype=np.float32).reshape(18, 3) / 7


def stored(place, seed=0, names=QUANTITIES):
    made = quantities(np.random.default_rng(seed))
    return stored_place(place, TRUTH, {name: made[name] for name in names})


@pytest.fixture
def path(tmp_path):
    file = tmp_path / "grid.msgpack"
    write_table(file, recipe(), QUANTITIES, [stored(train_place()), stored(place_to_test(), 1)])
    return file


def rewritten(path, **changes):
    """The file with other content, and a checksum that fits."""
    table = replace(read_stored_table(path), **changes)
    write_table(path, table.recipe, table.quantities, table.places)
    return path


def test_what_was_stored_is_read_within_a_step(path):
    table = read_table(path)
    assert table.places == (train_place(), place_to_test())
    assert (table.truth == TRUTH).all()
    for number in range(2):
        for name, values in quantities(np.random.default_rng(number)).items():
            read = table.quantities[name][number]
            assert (np.isnan(read) == np.isnan(values)).all()
            step = 0.5 / 255 if name in SHARES else 0.018 * values
            assert (np.isnan(values) | (np.abs(read - values) <= step + 1e-6)).all()


def test_what_was_read_is_stored_as_the_same_bytes(path):
    table, before = read_table(path), read_stored_table(path)
    again = stored_place(table.places[1], table.truth[1], {name: table.quantities[name][1] for name in QUANTITIES})
    assert stored_numbers(again) == stored_numbers(before.places[1])
    assert again.truth == before.places[1].truth


@pytest.mark.parametrize(("length", "read"), [(0.0, 0.001), (1e-9, 0.001), (1e6, 0.001 * 1.035**254)])
def test_a_length_out_of_range_is_the_nearest_one_there_is(tmp_path, length, read):
    made = {name: np.full((CELLS, JOINT_COUNT), length, np.float32) for name in LENGTHS}
    places = [stored_place(place, TRUTH, made) for place in (train_place(), place_to_test())]
    write_table(tmp_path / "t", recipe("metres"), LENGTHS, places)
    assert read_table(tmp_path / "t").quantities["radius"] == pytest.approx(read)


def test_cells_are_counted_along_x_then_y():
    assert [cell_of(-9, -9), cell_of(-8, -9), cell_of(-9, -8), cell_of(9, 9)] == [0, 1, 19, 360]


def test_environments_are_found_by_split(path):
    table = read_table(path)
    assert table.of_split("train").tolist() == [0]
    assert table.of_split("test").tolist() == [1]


def test_an_environment_with_a_missing_view_is_not_stored_and_is_named():
    made = quantities(np.random.default_rng(0), cells=CELLS - 1)
    with pytest.raises(ArtifactDamaged, match=r"identity 3, pose 3, seed 103 has mass .*a view is missing"):
        stored_place(train_place(3), TRUTH, made)


def test_an_environment_with_a_missing_view_is_not_read_and_is_named(path):
    short = stored(place_to_test(2), 1, QUANTITIES[1:])
    rewritten(path, places=(read_stored_table(path).places[0], short))
    with pytest.raises(ArtifactDamaged, match=r"identity 42, pose 2, seed 202 has 32490 numbers, not 38988"):
        read_table(path)


def test_an_environment_without_a_true_joint_is_refused(path):
    first, second = read_stored_table(path).places
    rewritten(path, places=(first, replace(second, truth=second.truth[:-4])))
    with pytest.raises(ArtifactDamaged, match="lacks the true position"):
        read_table(path)


def test_an_identity_in_both_splits_is_refused_by_its_number(path):
    train, test = read_stored_table(path).places
    rewritten(path, places=(train, test, replace(test, place=replace(test.place, split="train"))))
    with pytest.raises(ArtifactDamaged, match="identity 40 is in both splits"):
        read_table(path)


@pytest.mark.parametrize("change", [{"identity": 41}, {"pose": 6}])
def test_a_person_or_a_pose_of_the_other_split_is_refused(path, change):
    train, test = read_stored_table(path).places
    rewritten(path, places=(replace(train, place=replace(train.place, **change)), test))
    with pytest.raises(ArtifactDamaged, match=r"seed 100 is in the train split, whose people or poses are others"):
        read_table(path)


@pytest.mark.parametrize("split", ["train", "test"])
def test_a_split_without_an_environment_is_refused(path, split):
    places = tuple(one for one in read_stored_table(path).places if one.place.split != split)
    rewritten(path, places=places)
    with pytest.raises(ArtifactDamaged, match=f"the {split} split has no environment"):
        read_table(path)


def test_a_table_without_what_its_certainty_needs_is_refused(path):
    table = read_stored_table(path)
    write_table(path, recipe("metres"), SHARES, table.places)
    with pytest.raises(ArtifactDamaged, match="lacks expected_error"):
        read_table(path)


def test_a_changed_byte_is_noticed(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(ArtifactDamaged):
        read_table(path)


def test_a_later_format_is_refused(path):
    path.write_bytes(msgspec.msgpack.encode(replace(read_stored_table(path), format=2)))
    with pytest.raises(ArtifactDamaged, match="format 2"):
        read_table(path)


def test_another_file_is_no_table(tmp_path):
    (tmp_path / "t").write_bytes(b"\x00")
    with pytest.raises(ArtifactDamaged, match="no grid table"):
        read_table(tmp_path / "t")
    with pytest.raises(ArtifactDamaged, match="can't be read"):
        read_table(tmp_path / "gone")
