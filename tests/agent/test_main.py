import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from agent.__main__ import main
from agent.connections import WorkerAccess
from protocol.failpoint import VARIABLE, Failpoints
from protocol.system.exit_code import ExitCode
from tests.agent.serving import agent_command, analytic_workers, environment
from tests.agent.test_commands import CONFIG

NOWHERE = WorkerAccess(("ipc:///nowhere/render",), ("ipc:///nowhere/perception",))


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["fly"],
        ["train", "--run", "r"],
        ["evaluate", "--run", "r", "--render", "a", "--perception", "b", "--episodes", "0"],
        ["train", "--run", "r", "--render", "a", "--perception", "b", "--http", "somewhere"],
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


def test_a_worker_that_is_not_there_may_come_so_it_ends_with_3(tmp_path: Path) -> None:
    (tmp_path / "config.toml").write_text(CONFIG.replace("startup = 5.0", "startup = 0.2"))
    assert main(["train", "--run", str(tmp_path), *addresses_of(NOWHERE)]) == ExitCode.FAILED


def test_a_run_of_another_configuration_is_left_alone_and_ends_with_2(tmp_path: Path, caplog) -> None:
    run = run_of(tmp_path, CONFIG)
    with analytic_workers(tmp_path) as workers:
        arguments = ["train", "--run", str(run), *addresses_of(workers)]
        assert main(arguments) == ExitCode.DONE
        (run / "config.toml").write_text(CONFIG.replace("seed = 5", "seed = 6"))
        before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
        assert main(arguments) == ExitCode.HOPELESS
    assert before == {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}


def addresses_of(workers: WorkerAccess) -> list[str]:
    return ["--render", *workers.render, "--perception", *workers.perception]


def run_of(directory: Path, config: str) -> Path:
    run = directory / "run"
    run.mkdir()
    (run / "config.toml").write_text(config)
    return run


def wait_for_steps(run: Path, process: subprocess.Popen[bytes]) -> None:
    """Until the training itself has flown: its phase is written down as it begins, before its first step."""
    while not any(line["phase"] == "training" and line["step"] > 0 for line in progress_of(run)):
        assert process.poll() is None
        time.sleep(0.05)


def progress_of(run: Path) -> list[dict[str, Any]]:
    """The lines that are whole; the last one may be under way."""
    path = run / "progress.jsonl"
    text = path.read_bytes() if path.exists() else b""
    return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith(b"\n")]


@pytest.mark.slow
@pytest.mark.parametrize("place", ["checkpoint-written", "checkpoint-renamed"])
def test_a_training_killed_at_a_failpoint_of_its_environment_goes_on(tmp_path: Path, place: str) -> None:
    run, failpoints = run_of(tmp_path, CONFIG), Failpoints(tmp_path / "failpoints")
    failpoints.order(place, "kill")
    variables = {**environment(), VARIABLE: str(tmp_path / "failpoints")}
    with analytic_workers(tmp_path) as workers:
        for code in (-signal.SIGKILL, 0):
            assert subprocess.run(agent_command("train", run, workers), env=variables, check=False).returncode == code
        other = tmp_path / "other"
        other.mkdir()
        (other / "config.toml").write_text(CONFIG)
        assert main(["train", "--run", str(other), *addresses_of(workers)]) == 0
    for name in ("weights.safetensors", "episodes.jsonl", "replay/000000.bin"):
        assert (run / name).read_bytes() == (other / name).read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("job", ["train", "evaluate"])
def test_an_orphan_keeps_what_it_has_and_ends_well(tmp_path: Path, job: str) -> None:
    clocks = "startup = 30.0\nheartbeat = 0.1\nliveness = 0.3\ngrace = 1.0"
    config = CONFIG.replace("startup = 5.0", clocks).replace("episodes = 3", "episodes = 1000000")
    run = run_of(tmp_path, config)
    orphan = ("--orchestrator", f"ipc://{tmp_path}/nobody", "--name", "agent")
    with analytic_workers(tmp_path) as workers:
        if job == "evaluate":
            assert main(["train", "--run", str(run), *addresses_of(workers)]) == 0
        else:
            (run / "config.toml").write_text(config.replace("steps = 20", "steps = 1000000"))
        process = subprocess.run(agent_command(job, run, workers, *orphan), env=environment(), check=False, timeout=60)
    assert process.returncode == 0
    if job == "evaluate":
        assert not (run / "evaluation.json").exists()
    else:
        assert not json.loads((run / "summary.json").read_bytes())["complete"]
        assert (run / "weights.safetensors").exists()
        assert list((run / "checkpoints").glob("step-*"))


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_training_told_to_stop_writes_what_it_has_and_ends_well(tmp_path: Path, number: signal.Signals) -> None:
    run = run_of(tmp_path, CONFIG.replace("steps = 20", "steps = 1000000"))
    with analytic_workers(tmp_path) as workers:
        process = subprocess.Popen(agent_command("train", run, workers), env=environment())
        try:
            wait_for_steps(run, process)
            process.send_signal(number)
            assert process.wait(120) == 0
        finally:
            process.kill()
    summary = json.loads((run / "summary.json").read_bytes())
    assert 0 < summary["steps"] < 1_000_000
    assert not summary["complete"]
    flown = 10 + summary["steps"]
    assert max((run / "checkpoints").iterdir()).name == f"step-{flown:09d}"
    assert (run / "weights.safetensors").exists()
    assert progress_of(run)[-1]["phase"] == "done"
