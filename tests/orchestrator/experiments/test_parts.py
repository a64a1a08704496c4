import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from orchestrator.experiments.parts import Parts


def part(number: int) -> pa.Table:
    return pa.table({"frame": [10 * number, 10 * number + 1]})


@pytest.fixture
def parts(tmp_path):
    return Parts(tmp_path / "table.parquet", 3)


def test_what_is_missing_is_what_was_not_written(parts):
    assert parts.missing() == (0, 1, 2)
    parts.write(1, part(1))
    assert parts.missing() == (0, 2)


def test_parts_become_one_table_in_their_order_whatever_the_order_of_writing(parts):
    for number in (2, 0, 1):
        parts.write(number, part(number))
    parts.join({"made.by": "us"})
    table = pq.read_table(parts.path)
    assert table["frame"].to_pylist() == [0, 1, 10, 11, 20, 21]
    assert table.schema.metadata == {b"made.by": b"us"}
    assert (parts.is_whole, parts.missing(), parts.folder.exists()) == (True, (), False)


def test_a_part_that_was_not_finished_does_not_count(parts, monkeypatch):
    def dies_half_way(table, path, **_):
        path.write_bytes(b"PAR1")
        raise KeyboardInterrupt

    monkeypatch.setattr(pq, "write_table", dies_half_way)
    with pytest.raises(KeyboardInterrupt):
        parts.write(0, part(0))
    assert parts.missing() == (0, 1, 2)
    assert list(parts.folder.iterdir()) == []


def test_joining_again_after_a_kill_between_the_table_and_the_end_of_the_parts_changes_nothing(parts):
    for number in range(3):
        parts.write(number, part(number))
    parts.join({})
    whole = parts.path.read_bytes()
    parts.write(0, part(7))
    parts.join({})
    assert (parts.path.read_bytes(), parts.folder.exists()) == (whole, False)
