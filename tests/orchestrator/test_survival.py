"""Whatever of a run is killed or stopped, it comes to its end. Processes and signals are real, the rooms stand-ins."""

import json
import os
import signal

import psutil
import pytest

from orchestrator.run.run_directory import RunDirectory

STEPS = 150
CONFIG = """
[timeouts]
heartbeat = 0.1
liveness = {liveness}
grace = {grace}

[training]
steps = {steps}

[evaluation]
episodes = {episodes}
baselines = ["stay"]
"""
PATIENCE = 60.0


class Rehearsal:
    """A run that is made to suffer."""

    def __init__(self, command, wait_until) -> None:
        self.command = command
        self.wait_until = wait_until
        self.path = command.folder / "one"
        self.run = RunDirectory(self.path)

    def train(self, *options: str, steps: int = STEPS, grace: float = 30.0, liveness: float = 5.0, episodes: int = 3):
        """Start a training, and wait until the agent has begun."""
        text = CONFIG.format(steps=steps, grace=grace, liveness=liveness, episodes=episodes)
        (self.command.folder / "short.toml").write_text(text)
        child = self.command.start("train", "short.toml", "--run", "one", "--json", *options)
        self.wait_until(lambda: self.run.progress() is not None or child.poll() is not None)
        assert child.poll() is None, child.communicate()[1]
        return child

    def resume(self, *options: str):
        return self.command.run("resume", "one", "--json", *options, patience=PATIENCE)

    def pid(self, name: str) -> int:
        return next(process.pid for process in self.run.processes() if process.name == name)

    def kill(self, child, number=signal.SIGKILL) -> None:
        """Kill the orchestrator itself."""
        os.kill(child.pid, number)
        child.communicate(timeout=PATIENCE)

    def is_evaluating(self) -> bool:
        progress = self.run.progress()
        return progress is not None and progress.phase == "evaluation"

    def steps(self) -> int:
        progress = self.run.progress()
        return progress.step if progress else 0


@pytest.fixture
def rehearsal(orchestrator, wait_until) -> Rehearsal:
    return Rehearsal(orchestrator, wait_until)


def finished(child) -> dict:
    out, err = child.communicate(timeout=PATIENCE)
    assert child.returncode == 0, err
    return json.loads(out)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["render-0", "perception-0", "agent"])
def test_a_training_goes_on_after_the_death_of_any_process(rehearsal, name):
    child = rehearsal.train()
    first = rehearsal.pid(name)
    os.kill(first, signal.SIGKILL)
    report = finished(child)
    assert (report["steps"], report["restarts"], report["interrupted"]) == (STEPS, {name: 1}, False)
    assert rehearsal.pid(name) != first
    assert rehearsal.command.alive() == set()
    assert list(rehearsal.command.temporary.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["render-0", "agent"])
def test_a_training_goes_on_after_any_process_was_stopped_for_good(rehearsal, name):
    child = rehearsal.train()
    os.kill(rehearsal.pid(name), signal.SIGSTOP)
    report = finished(child)
    assert (report["steps"], report["restarts"]) == (STEPS, {name: 1})
    assert "hung (silent for 5 s)" in rehearsal.run.restarts()[0].reason


@pytest.mark.slow
def test_an_orchestrator_that_was_stopped_for_a_while_counts_no_process_as_hung(rehearsal):
    child = rehearsal.train(steps=600, liveness=2.0)
    os.kill(child.pid, signal.SIGSTOP)
    here = rehearsal.steps()
    # Longer than the liveness clock of every other process.
    rehearsal.wait_until(lambda: rehearsal.steps() > here + 300)
    os.kill(child.pid, signal.SIGCONT)
    assert finished(child)["restarts"] == {}


@pytest.mark.slow
def test_an_orchestrator_that_was_stopped_until_all_had_ended_starts_them_again(rehearsal):
    child = rehearsal.train(steps=600, grace=1.0)
    os.kill(child.pid, signal.SIGSTOP)
    rehearsal.wait_until(lambda: rehearsal.command.alive() == {child.pid})
    os.kill(child.pid, signal.SIGCONT)
    report = finished(child)
    assert (report["steps"], set(report["restarts"])) == (600, {"render-0", "perception-0", "agent"})


@pytest.mark.slow
def test_a_killed_orchestrators_processes_are_taken_up_and_brought_to_the_end(rehearsal):
    rehearsal.kill(rehearsal.train(steps=300))
    before = {process.name: process.pid for process in rehearsal.run.processes()}
    done = rehearsal.resume()
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["steps"], report["restarts"]) == (300, {})
    assert {score["policy"] for score in report["evaluation"]["scores"]} == {"trained", "stay"}
    log = (rehearsal.run.orchestrator_log).read_text()
    assert all(f"adopted {name}, as process {pid}" in log for name, pid in before.items())
    assert rehearsal.command.alive() == set()
    assert list(rehearsal.command.temporary.iterdir()) == []


@pytest.mark.slow
def test_what_died_with_the_orchestrator_is_started_and_the_rest_taken_up(rehearsal):
    child = rehearsal.train(steps=300)
    before = {process.name: process.pid for process in rehearsal.run.processes()}
    os.kill(child.pid, signal.SIGSTOP)
    os.kill(before["agent"], signal.SIGKILL)
    rehearsal.kill(child)
    assert rehearsal.resume().returncode == 0
    log = rehearsal.run.orchestrator_log.read_text()
    assert f"adopted render-0, as process {before['render-0']}" in log
    assert "adopted agent" not in log
    assert rehearsal.run.is_finished()


@pytest.mark.slow
def test_an_agent_that_was_never_written_down_is_not_doubled(rehearsal):
    child = rehearsal.train(steps=300)
    agent = rehearsal.pid("agent")
    rehearsal.kill(child)
    rehearsal.run.write_processes([one for one in rehearsal.run.processes() if one.name != "agent"])
    resumed = rehearsal.command.start("resume", "one")
    rehearsal.wait_until(lambda: rehearsal.run.is_busy() and f"adopted agent, as process {agent}" in text(rehearsal))
    agents = [pid for pid in rehearsal.command.alive() if psutil.Process(pid).cmdline()[3:5] == ["agent", "train"]]
    assert agents == [agent]
    _, err = resumed.communicate(timeout=PATIENCE)
    assert resumed.returncode == 0, err


def text(rehearsal) -> str:
    return rehearsal.run.orchestrator_log.read_text()


@pytest.mark.slow
def test_processes_without_an_orchestrator_end_by_themselves_and_the_run_goes_on_later(rehearsal):
    rehearsal.kill(rehearsal.train(steps=600, grace=1.0))
    abandoned = json.loads(rehearsal.command.run("status", "one", "--json").stdout)
    assert abandoned["state"] == "abandoned"
    rehearsal.wait_until(lambda: rehearsal.command.alive() == set())
    summary = rehearsal.run.summary()
    assert summary is not None
    assert not summary.complete
    said = rehearsal.command.run("status", "one").stdout
    assert "the run is not finished: continue it by 'orchestrator resume one'" in said
    done = rehearsal.resume()
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["steps"] == 600
    assert list(rehearsal.command.temporary.iterdir()) == []


@pytest.mark.slow
def test_an_orchestrator_may_be_killed_again_and_again(rehearsal):
    child = rehearsal.train(steps=600)
    for _ in range(3):
        rehearsal.kill(child)
        here = rehearsal.steps()
        child = rehearsal.command.start("resume", "one", "--json")
        rehearsal.wait_until(lambda here=here: rehearsal.run.is_busy() and rehearsal.steps() > here)
    report = finished(child)
    assert (report["steps"], report["restarts"]) == (600, {})


@pytest.mark.slow
def test_a_training_that_was_stopped_on_request_can_be_resumed(rehearsal):
    child = rehearsal.train(steps=300)
    os.kill(child.pid, signal.SIGINT)
    child.communicate(timeout=PATIENCE)
    assert child.returncode == 130
    stopped = rehearsal.steps()
    assert 0 < stopped < 300
    done = rehearsal.resume()
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["steps"] == 300
    assert f"from step {stopped} on" in (rehearsal.path / "logs" / "agent.jsonl").read_text()


@pytest.mark.slow
def test_ctrl_c_ends_processes_that_were_taken_up_as_well(rehearsal):
    rehearsal.kill(rehearsal.train(steps=100_000))
    resumed = rehearsal.command.start("resume", "one", "--json")
    rehearsal.wait_until(lambda: rehearsal.run.is_busy() and "adopted agent" in text(rehearsal))
    os.kill(resumed.pid, signal.SIGINT)
    out, err = resumed.communicate(timeout=PATIENCE)
    assert resumed.returncode == 130, err
    assert json.loads(out)["interrupted"]
    assert rehearsal.command.alive() == set()


@pytest.mark.slow
def test_ctrl_c_ends_orphans_even_before_the_workers_are_ready(rehearsal):
    child = rehearsal.train(steps=100_000)
    rehearsal.kill(child)
    # Not before: the system ends a stopped process that becomes an orphan (SIGHUP).
    os.kill(rehearsal.pid("render-0"), signal.SIGSTOP)
    resumed = rehearsal.command.start("resume", "one")
    rehearsal.wait_until(lambda: rehearsal.run.is_busy() and "adopted render-0" in text(rehearsal))
    os.kill(resumed.pid, signal.SIGINT)
    _, err = resumed.communicate(timeout=PATIENCE)
    assert resumed.returncode == 130, err
    assert rehearsal.command.alive() == set()


@pytest.mark.slow
def test_an_evaluation_is_flown_to_its_end_whatever_is_killed_in_it(rehearsal):
    child = rehearsal.train(steps=20, episodes=200)
    rehearsal.wait_until(rehearsal.is_evaluating)
    first = rehearsal.pid("evaluation")
    os.kill(first, signal.SIGKILL)
    rehearsal.wait_until(lambda: rehearsal.pid("evaluation") != first)
    rehearsal.kill(child)
    evaluation = rehearsal.pid("evaluation")
    done = rehearsal.resume()
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert (report["steps"], report["restarts"]) == (20, {"evaluation": 1})
    assert [score["episodes"] for score in report["evaluation"]["scores"]] == [200, 200]
    assert f"adopted evaluation, as process {evaluation}" in text(rehearsal)
    assert text(rehearsal).count("started agent") == 1


@pytest.mark.slow
def test_a_finished_run_is_reported_again_and_nothing_is_started(rehearsal):
    report = finished(rehearsal.train())
    before = rehearsal.run.workers_path.read_bytes(), rehearsal.run.evaluation_path.stat().st_mtime_ns
    again = rehearsal.resume()
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout) == report
    assert (rehearsal.run.workers_path.read_bytes(), rehearsal.run.evaluation_path.stat().st_mtime_ns) == before


@pytest.mark.slow
def test_a_run_that_was_to_have_no_evaluation_gets_none(rehearsal):
    rehearsal.kill(rehearsal.train("--no-evaluate"))
    done = rehearsal.resume()
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["evaluation"] is None


@pytest.mark.slow
def test_a_run_has_one_orchestrator_and_an_abandoned_training_no_evaluation(rehearsal):
    child = rehearsal.train(steps=100_000)
    busy = rehearsal.resume()
    assert (busy.returncode, "another orchestrator works on one" in busy.stderr) == (1, True)
    rehearsal.kill(child)
    refused = rehearsal.command.run("evaluate", "one")
    assert refused.returncode == 1
    assert "the training of one continues without an orchestrator; take it over by 'orchestrator resume one'" in (
        refused.stderr
    )
    assert psutil.pid_exists(rehearsal.pid("agent"))


@pytest.mark.slow
def test_a_process_that_fails_for_ever_ends_the_run_with_its_words(rehearsal):
    (rehearsal.command.folder / "short.toml").write_text(
        CONFIG.format(steps=STEPS, grace=30.0, liveness=5.0, episodes=3)
        + "[supervision]\nmax_restarts = 2\ninitial_backoff = 0.1\n"
    )
    done = rehearsal.command.run("train", "short.toml", "--run", "one", rooms=("render_crashes_at_start",))
    assert done.returncode == 1
    said, then = done.stderr.splitlines()[-2:]
    assert said.startswith("render-0 was killed by SIGABRT: out of paint (log: one/logs/render-0.jsonl)")
    assert said.endswith("it was restarted 2 times within 60 s already")
    assert then == "continue the run by 'orchestrator resume one'"
    assert rehearsal.command.alive() == set()
