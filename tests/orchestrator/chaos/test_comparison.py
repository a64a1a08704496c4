import pytest

from orchestrator.chaos.comparison import compare
from orchestrator.chaos.errors import RehearsalFailed

ROWS, DRONES, SIZE = 6, 4, 50
FIRST, SECOND = bytes(range(4 * SIZE)), bytes(range(100, 100 + 2 * SIZE))


@pytest.fixture
def make(tmp_path):
    """A run directory with what is compared in it: six different rows in two segments."""

    def make(name):
        run = tmp_path / name
        (run / "replay").mkdir(parents=True)
        (run / "weights.safetensors").write_bytes(bytes(range(256)) * 8000)
        (run / "episodes.jsonl").write_bytes(b'{"number":0}\n{"number":1}\n')
        (run / "replay" / "000000.bin").write_bytes(FIRST)
        (run / "replay" / "000001.bin").write_bytes(SECOND)
        return run

    return make


@pytest.fixture
def runs(make):
    return make("control_run"), make("touched")


def compared(runs):
    return compare(*runs, rows=ROWS, drones=DRONES)


def flip(path, index):
    data = bytearray(path.read_bytes())
    data[index] ^= 1
    path.write_bytes(data)


def test_runs_that_came_to_the_same_are_identical(runs):
    found = compared(runs)
    assert found.identical
    assert (found.transitions, found.lost, found.doubled, found.differences) == (24, 0, 0, ())


def test_what_is_not_compared_makes_no_difference(runs):
    (runs[1] / "progress.jsonl").write_bytes(b"{}\n")
    assert compared(runs).identical


@pytest.mark.parametrize("index", [0, 1_048_576, 2_047_999])
def test_a_flipped_bit_in_the_weights_is_seen_wherever_it_is(runs, index):
    flip(runs[1] / "weights.safetensors", index)
    found = compared(runs)
    assert (found.identical, found.weights, found.episodes, found.replay) == (False, False, True, True)
    assert found.differences == (f"weights.safetensors differs from byte {index} on",)


def test_a_flipped_bit_in_the_episodes_is_seen(runs):
    flip(runs[1] / "episodes.jsonl", 12)
    found = compared(runs)
    assert (found.identical, found.episodes) == (False, False)


def test_an_episode_too_few_is_seen(runs):
    (runs[1] / "episodes.jsonl").write_bytes(b'{"number":0}\n')
    assert compared(runs).differences == ("episodes.jsonl differs from byte 13 on",)


def test_a_flipped_bit_in_the_replay_is_a_lost_and_a_foreign_step(runs):
    flip(runs[1] / "replay" / "000000.bin", 2 * SIZE + 7)
    found = compared(runs)
    assert (found.identical, found.replay, found.lost, found.doubled) == (False, False, DRONES, DRONES)


def test_a_lost_row_is_counted(runs):
    (runs[1] / "replay" / "000000.bin").write_bytes(FIRST[:SIZE] + FIRST[2 * SIZE :])
    found = compared(runs)
    assert (found.identical, found.lost, found.doubled) == (False, DRONES, 0)


def test_a_doubled_row_is_counted(runs):
    (runs[1] / "replay" / "000001.bin").write_bytes(SECOND + SECOND[-SIZE:])
    found = compared(runs)
    assert (found.identical, found.lost, found.doubled) == (False, 0, DRONES)


def test_rows_in_another_order_are_not_identical_though_none_is_lost(runs):
    (runs[1] / "replay" / "000001.bin").write_bytes(SECOND[SIZE:] + SECOND[:SIZE])
    found = compared(runs)
    assert (found.identical, found.lost, found.doubled) == (False, 0, 0)


def test_rows_that_are_the_same_are_told_apart_by_their_number(runs):
    for run in runs:
        (run / "replay" / "000001.bin").write_bytes(SECOND[:SIZE] * 2)
    assert compared(runs).identical
    (runs[1] / "replay" / "000001.bin").write_bytes(SECOND[:SIZE])
    assert compared(runs).lost == DRONES


@pytest.mark.parametrize("name", ["weights.safetensors", "episodes.jsonl", "replay/000001.bin"])
@pytest.mark.parametrize("whose", [0, 1])
def test_a_missing_file_is_named(runs, name, whose):
    (runs[whose] / name).unlink()
    found = compare(*runs, rows=ROWS if whose or "replay" not in name else 4, drones=DRONES)
    assert not found.identical
    assert found.differences == (f"{name} is missing in {runs[whose]}",)


def test_one_segment_instead_of_two_is_not_identical(runs):
    (runs[1] / "replay" / "000000.bin").write_bytes(FIRST + SECOND)
    (runs[1] / "replay" / "000001.bin").unlink()
    found = compared(runs)
    assert (found.identical, found.lost, found.doubled) == (False, 0, 0)


def test_runs_without_a_journal_are_compared_by_the_rest(runs):
    for run in runs:
        for path in (run / "replay").iterdir():
            path.unlink()
    found = compared(runs)
    assert (found.identical, found.transitions) == (True, 0)


def test_a_journal_that_can_not_have_so_many_rows_is_refused(runs):
    with pytest.raises(RehearsalFailed, match="300 bytes, which are not 7 rows"):
        compare(*runs, rows=7, drones=DRONES)
