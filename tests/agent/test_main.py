import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from agent.__main__ import main
from agent.connections import Workers
from tests.agent.serving import agent_command, analytic_workers, environment
from tests.agent.test_commands import CONFIG

NOWHERE = Workers(("ipc:///nowhere/render",), ("ipc:///nowhere/perception",))


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["fly"],
        ["train", "--run", "r"],
        ["evaluate", "--run", "r", "--render", "a", "--perception", "b", "--episodes", "0"],
    ],
)
def test_a_mistyped_command_is_told_at_once(arguments, capsys) -> None:
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    assert "usage: python -m agent" in capsys.readouterr().err


def test_importing_the_room_registers_its_environment_and_loads_no_torch() -> None:
    code = "import agent, gymnasium, sys; print('vantage/Hover-v0' in gymnasium.registry, 'torch' in sys.modules)"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.split() == ["True", "False"]


def test_what_can_not_be_done_ends_with_2_and_one_clear_line(tmp_path: Path) -> None:
    process = subprocess.run(agent_command("train", tmp_path, NOWHERE), capture_output=True, text=True, check=False)
    assert process.returncode == 2
    (line,) = process.stderr.splitlines()
    record = json.loads(line)
    assert (record["level"], record["role"]) == ("error", "agent")
    assert "config.toml" in record["message"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_training_told_to_stop_writes_what_it_has_and_ends_well(tmp_path: Path, number: signal.Signals) -> None:
    run = tmp_path / "run"
    run.mkdir()
    (run / "config.toml").write_text(CONFIG.replace("steps = 20", "steps = 1000000"))
    with analytic_workers(tmp_path) as workers:
        process = subprocess.Popen(agent_command("train", run, workers), env=environment())
        while not (run / "progress.jsonl").exists() or b"training" not in (run / "progress.jsonl").read_bytes():
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        assert process.wait(30) == 0
    summary = json.loads((run / "summary.json").read_bytes())
    assert 0 < summary["steps"] < 1_000_000
    assert (run / "weights.safetensors").exists()
    assert json.loads((run / "progress.jsonl").read_bytes().splitlines()[-1])["phase"] == "done"
