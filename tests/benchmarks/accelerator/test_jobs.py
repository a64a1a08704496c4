import io
import sys

import pytest
from rich.console import Console

from benchmarks.accelerator import jobs as jobs_module
from benchmarks.accelerator.jobs import Jobs, Missing
from benchmarks.accelerator.places import Place

CPU, GPU = Place("CPU", {}), Place("GPU", {})

FOUND = """
import msgspec, sys
from benchmarks.accelerator.measured import Measured, hand_over
print("a library says something")
hand_over(Measured(device="a CPU", on_gpu=False, seconds={"render": [0.5]}, digests={}))
"""


@pytest.fixture
def jobs_of(tmp_path, monkeypatch):
    """Jobs whose measuring process runs the code given."""
    interpreter = sys.executable

    def made(code, **settings):
        script = tmp_path / "script.py"
        script.write_text(code)
        monkeypatch.setattr(jobs_module.sys, "executable", str(tmp_path / "python"))
        python = tmp_path / "python"
        python.write_text(f"#!/bin/sh\nexec {interpreter} {script}\n")
        python.chmod(0o755)
        return Jobs(tmp_path, Console(file=io.StringIO()), **({"seconds": 60.0} | settings))

    monkeypatch.setenv("PYTHONPATH", ":".join(sys.path))
    return made


def test_a_process_tells_in_its_last_line_what_it_found(jobs_of):
    found = jobs_of(FOUND).measure("render-CPU", "render", CPU)
    assert not isinstance(found, Missing)
    assert found.seconds == {"render": [0.5]}


def test_what_turns_out_to_be_no_gpu_is_not_measured_as_one(jobs_of):
    assert jobs_of(FOUND).measure("render-GPU", "render", GPU) == Missing("it would be a CPU, which is no GPU")
    assert not isinstance(jobs_of(FOUND, anything=True).measure("render-GPU", "render", GPU), Missing)


def test_a_library_that_could_not_be_loaded_is_the_reason(jobs_of):
    complaint = 'import sys; print("\\x1b[1mFailed with error: libcudnn.so.9: not there\\x1b[m", file=sys.stderr)\n'
    found = jobs_of(complaint + FOUND).measure("perceive-GPU", "perceive", GPU)
    assert found == Missing("it would be a CPU, which is no GPU; libcudnn.so.9: not there")


def test_a_process_that_fails_says_why_without_its_modules(jobs_of):
    code = "from protocol.errors import Unavailable\nraise Unavailable('no OpenGL: none at all')"
    assert jobs_of(code).measure("render-GPU", "render", GPU) == Missing("no OpenGL: none at all")


def test_a_process_that_ends_without_a_word_is_told_as_well(jobs_of):
    found = jobs_of("raise SystemExit(3)").measure("render-CPU", "render", CPU)
    assert found == Missing("it ended with 3 and without a word")


def test_a_process_that_takes_too_long_is_ended(jobs_of):
    found = jobs_of("import time; time.sleep(60)", longest=1.0).measure("learn-CPU", "learn", CPU)
    assert found == Missing("not through within 1 s")


def test_nothing_is_begun_once_the_time_is_up(jobs_of):
    assert jobs_of(FOUND, seconds=0.5).measure("learn-CPU", "learn", CPU) == Missing("no time was left")


REPORTS = """
import json, signal, sys, time
report = dict(run="run", interrupted=True, steps=7, episodes=0, updates=0, seconds=1.0, steps_per_second=7.0, stages={},
              late_replies=0, retries=0, restarts={}, recycled={}, evaluation=None)
def stopped(*_):
    print(json.dumps(report))
    sys.exit(130)
signal.signal(signal.SIGTERM, stopped)
"""


def test_a_training_that_takes_too_long_tells_what_it_came_to(jobs_of):
    report = jobs_of(f"{REPORTS}time.sleep(60)").train("loop-CPU", CPU, "", longest=3.0)
    assert not isinstance(report, Missing)
    assert report.steps == 7


def test_a_training_that_came_to_nothing_in_its_time_is_missing(jobs_of):
    assert jobs_of("import time; time.sleep(60)").train("loop-CPU", CPU, "", longest=1.0) == Missing(
        "not through within 1 s"
    )
