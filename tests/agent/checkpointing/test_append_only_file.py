import hashlib

import pytest

from agent.checkpointing.append_only_file import AppendOnlyFile, mark_of, require_intact
from agent.errors import JournalDamaged
from tests.agent.checkpointing.full_disk import no_file_larger_than


def test_what_is_added_is_there_once_it_is_written(tmp_path) -> None:
    path = tmp_path / "file"
    file = AppendOnlyFile(path)
    file.add(b"one ")
    file.add(b"two ")
    assert (path.read_bytes(), file.length, file.mark.length) == (b"", 8, 0)
    file.sync()
    assert path.read_bytes() == b"one two "
    assert (file.mark.length, file.mark.sha256) == (8, hashlib.sha256(b"one two ").hexdigest())
    assert file.mark == mark_of(path)
    file.close()


def test_a_file_opened_again_is_cut_back_and_goes_on(tmp_path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"one two three")
    file = AppendOnlyFile(path, 8)
    assert path.read_bytes() == b"one two "
    file.add(b"four")
    file.write()
    assert path.read_bytes() == b"one two four"
    assert file.mark == mark_of(path)
    file.close()


def test_what_a_full_disk_did_not_take_is_written_whole_later(tmp_path) -> None:
    path = tmp_path / "file"
    file = AppendOnlyFile(path)
    file.add(b"a" * 600)
    file.write()
    before = file.mark
    file.add(b"b" * 600)
    with no_file_larger_than(1000), pytest.raises(OSError, match="File too large"):
        file.sync()
    assert path.stat().st_size == 600, "nothing half written is left"
    assert file.mark == before
    file.add(b"c" * 600)
    file.sync()
    assert path.read_bytes() == b"a" * 600 + b"b" * 600 + b"c" * 600
    assert file.mark == mark_of(path)
    file.close()


def test_a_file_that_has_grown_since_is_intact(tmp_path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"one")
    mark = mark_of(path)
    path.write_bytes(b"one two")
    require_intact(path, mark)


@pytest.mark.parametrize(("content", "words"), [(None, "is missing"), (b"on", "2 bytes of 3"), (b"0ne", "is not what")])
def test_a_file_that_is_not_what_was_marked_is_named(tmp_path, content, words) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"one")
    mark = mark_of(path)
    path.unlink() if content is None else path.write_bytes(content)
    with pytest.raises(JournalDamaged, match=f"{path} .*{words}|{path} {words}"):
        require_intact(path, mark)
