from pathlib import Path

import pytest
from msgspec import Struct

from orchestrator.run.json_lines import TAIL, Follower, last_lines, last_record


class Number(Struct):
    value: int


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "lines.jsonl"


def test_the_last_lines_come_last_first_without_empty_ones(file):
    file.write_bytes(b"one\n\ntwo\nthree")
    assert last_lines(file) == [b"three", b"two", b"one"]


def test_lines_before_a_process_of_its_own_are_left_out(file):
    file.write_bytes(b"of an earlier one\n")
    start = file.stat().st_size
    assert last_lines(file, start) == []
    with file.open("ab") as log:
        log.write(b"mine\n")
    assert last_lines(file, start) == [b"mine"]


def test_a_file_that_is_not_there_has_no_lines(file):
    assert last_lines(file) == []
    assert last_record(file, Number) is None
    assert list(Follower(file).new_lines()) == []


def test_the_end_of_a_long_file_is_found(file):
    file.write_bytes(b'{"value":1}\n' * TAIL + b'{"value":2}\n')
    assert last_record(file, Number) == Number(2)


def test_what_is_no_record_is_passed_over(file):
    file.write_bytes(b'{"value":1}\nnonsense\n{"value":')
    assert last_record(file, Number) == Number(1)


def test_a_follower_gives_each_whole_line_once(file):
    follower = Follower(file)
    file.write_bytes(b"one\ntw")
    assert list(follower.new_lines()) == [b"one"]
    with file.open("ab") as log:
        log.write(b"o\nthree\n")
    assert list(follower.new_lines()) == [b"two", b"three"]
    assert list(follower.new_lines()) == []
