from benchmarks.accelerator.differences import Difference
from benchmarks.accelerator.jobs import Missing
from benchmarks.accelerator.measured import Measured
from benchmarks.accelerator.tables import Row, difference_table, loop_table, missing_gpu, stage_table

DRAWN = Measured(
    device="llvmpipe", on_gpu=False, seconds={"render": [0.01, 0.02, 0.03]}, digests={"rgb": "a", "depth": "b"}
)
NO_GPU = Missing("EGL gives llvmpipe")


def row(found, again=None, place="CPU", title="render"):
    return Row(f"{title}-{place}", title, "", place, found, found if again is None else again)


def test_a_stage_has_its_median_and_whether_its_bytes_came_again():
    other = Measured(device="llvmpipe", on_gpu=False, seconds={}, digests={"rgb": "a", "depth": "c"})
    lines = stage_table([row(DRAWN), row(DRAWN, other), row(DRAWN, Missing("no time was left"))]).splitlines()[2:]
    assert lines == [
        "| render | CPU: llvmpipe | 20.00 | 29.80 | yes |",
        "| render | CPU: llvmpipe | 20.00 | 29.80 | no: depth |",
        "| render | CPU: llvmpipe | 20.00 | 29.80 | not tried: no time was left |",
    ]


def test_what_is_missing_is_said_in_its_row():
    assert "| render | GPU: not measured, EGL gives llvmpipe | | | |" in stage_table([row(NO_GPU, place="GPU")])


def test_stages_that_only_the_cpu_does_are_told_once():
    seen = Measured(
        device="CUDA",
        on_gpu=True,
        seconds={"infer, track": [0.01], "decode, track": [0.01]},
        digests={"track/heatmaps": "a", "track/keypoints": "b"},
    )
    assert "decode" in stage_table([row(seen)])
    assert "decode" not in stage_table([row(seen, place="GPU")])


def test_one_sentence_says_what_there_was_no_gpu_for():
    rows = [row(DRAWN), row(NO_GPU, place="GPU"), row(Missing("no CUDA"), place="GPU", title="perceive by torch")]
    assert missing_gpu(rows) == "No GPU was measured for all of it: render, EGL gives llvmpipe; perceive, no CUDA."
    assert missing_gpu([row(DRAWN), row(DRAWN, place="GPU")]) is None


def test_differences_are_told_by_what_is_compared():
    table = difference_table({"render on the GPU": [Difference("depth, mm", 0.5, 1234.5, 0.25, 3)]})
    assert table.splitlines()[-1] == "| render on the GPU | depth, mm | 0.5 | 1.23e+03 | 25.00% | 3 |"


def test_a_training_that_was_not_possible_has_its_row():
    assert loop_table({"GPU": Missing("there is no GPU")}).endswith("| GPU | | not measured: there is no GPU |")
