"""The whole command on stand-ins for the rooms, with the real orchestrator: `test_real_rooms` has it on real ones."""

import json
import signal
from pathlib import Path

import psutil
import pytest

from orchestrator.chaos.scenarios.children import MARK

ROOMS = Path(__file__).parent / "rooms"
SHORT = "[training]\nsteps = 400\nprefill = 0\n[environment]\nnum_envs = 4\n"
PATIENCE = 200.0

pytestmark = pytest.mark.slow


@pytest.fixture
def chaos(orchestrator):
    """Starts the command, with the agent of that name."""
    (orchestrator.folder / "short.toml").write_text(SHORT)

    def chaos(agent, *arguments):
        rooms = (str(ROOMS / "shared"), str(ROOMS / agent))
        return orchestrator.start("chaos", "short.toml", "--seed", "3", "--json", *arguments, rooms=rooms)

    return chaos


def marked_processes():
    found = []
    for process in psutil.process_iter():
        try:
            if MARK in process.environ():
                found.append(process.environ()[MARK])
        except (psutil.Error, OSError):
            continue
    return found


def only(*names):
    return [word for name in names for word in ("--only", name)]


def test_a_training_that_goes_on_to_the_bit_passes_and_leaves_no_process(orchestrator, chaos):
    names = ("kill-agent", "kill-orchestrator", "kill-render", "kill-at-checkpoint-written")
    child = chaos("remembers", "--faults", "4", *only(*names))
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0, out + err
    report = json.loads(out)
    assert report["passed"]
    assert (report["comparison"]["transitions"], report["comparison"]["lost"]) == (400, 0)
    assert set(report["classes"]) == set(names)
    assert all(found["worst_seconds"] > 0 for found in report["classes"].values())
    assert report["restarts"]["orchestrator"] == 1
    assert report["restarts"]["render-0"] == 1
    assert report["restarts"]["agent"] == 2
    assert not [mark for mark in marked_processes() if str(orchestrator.folder) in mark]
    assert list(orchestrator.temporary.iterdir()) == []


def test_every_fault_is_played_on_a_training_that_takes_no_time(chaos):
    names = ("stop-orchestrator", "kill-at-checkpoint-pruned", "kill-render", "kill-agent")
    out, err = chaos("hurries", "--faults", "4", *only(*names)).communicate(timeout=PATIENCE)
    report = json.loads(out)
    assert report["not_played"] == [], err
    assert (report["passed"], len(report["faults"])) == (True, 4)


def test_a_training_that_is_too_short_for_so_many_faults_is_refused(chaos):
    child = chaos("hurries", "--faults", "5")
    _, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 2, err
    assert "has room for at most 4 faults, not for 5; ask for fewer, or train longer" in err


def test_a_training_that_doubles_steps_is_found_out_and_the_control_run_is_used_again(chaos):
    child = chaos("forgets", "--faults", "1", *only("kill-at-checkpoint-journal-synced"))
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 1, out + err
    report = json.loads(out)
    assert (report["passed"], report["control_run_reused"]) == (False, False)
    assert (report["comparison"]["replay"], report["comparison"]["lost"]) == (False, 0)
    assert report["comparison"]["doubled"] > 0
    assert report["comparison"]["differences"][0].startswith("replay/000000.bin differs from byte ")

    child = chaos("forgets", "--faults", "1", *only("garbage"))
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0, out + err
    assert json.loads(out)["control_run_reused"]


def test_ctrl_c_leaves_no_process(orchestrator, chaos, wait_until):
    child = chaos("remembers", "--faults", "1", *only("stop-agent"))
    wait_until(lambda: bool(list(orchestrator.folder.glob("runs/chaos/control-*/progress.jsonl"))))
    child.send_signal(signal.SIGINT)
    _, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 130, err
    assert not [mark for mark in marked_processes() if str(orchestrator.folder) in mark]
    assert list(orchestrator.temporary.iterdir()) == []
