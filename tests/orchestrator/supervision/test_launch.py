import sys
from itertools import pairwise
from pathlib import Path

from orchestrator.supervision.launch import (
    Evaluate,
    addresses,
    evaluation_launch,
    module_command,
    training_launch,
    worker_launches,
)
from protocol.config import PerceptionConfig, RenderConfig, RunConfig
from protocol.messages import Role

SOCKETS = Path("/tmp/v")
CONFIG = Path("run/config.toml")


def values(command: tuple[str, ...], option: str) -> list[str]:
    return [value for name, value in pairwise(command) if name == option]


def test_as_many_workers_of_each_role_are_started_as_the_configuration_says():
    config = RunConfig(render=RenderConfig(workers=2), perception=PerceptionConfig(workers=3))
    workers = worker_launches(config, CONFIG, SOCKETS)
    assert [worker.name for worker in workers] == [
        "render-0",
        "render-1",
        "perception-0",
        "perception-1",
        "perception-2",
    ]
    assert len(set(addresses(workers))) == 5


def test_every_perception_worker_may_ask_every_render_worker():
    config = RunConfig(render=RenderConfig(workers=2), perception=PerceptionConfig(workers=2))
    workers = worker_launches(config, CONFIG, SOCKETS)
    renderers = list(addresses(workers, Role.RENDER))
    for worker in workers:
        expected = renderers if worker.role is Role.PERCEPTION else []
        assert values(worker.command, "--render") == expected
        assert values(worker.command, "--bind") == [worker.address]
        assert values(worker.command, "--config") == [str(CONFIG.resolve())]


def test_the_agent_is_told_of_every_worker_and_serves_nothing():
    workers = worker_launches(RunConfig(), CONFIG, SOCKETS)
    agent = training_launch(Path("run"), workers, SOCKETS)
    assert agent.address is None
    assert agent.command[:5] == module_command("agent", "train")
    assert values(agent.command, "--run") == [str(Path("run").resolve())]
    assert values(agent.command, "--render") == ["ipc:///tmp/v/render-0"]
    assert values(agent.command, "--perception") == ["ipc:///tmp/v/perception-0"]


def test_agents_of_a_joined_run_are_given_its_keys_and_no_addresses():
    options = ("--key", "/keys/trainer.key")
    evaluate = Evaluate(policies=("stay",))
    for agent in (
        training_launch(Path("run"), (), SOCKETS, options),
        evaluation_launch(Path("run"), (), SOCKETS, evaluate, options),
    ):
        assert values(agent.command, "--key") == ["/keys/trainer.key"]
        assert values(agent.command, "--render") == values(agent.command, "--perception") == []


def test_every_process_is_told_its_name_and_where_to_register():
    workers = worker_launches(RunConfig(), CONFIG, SOCKETS)
    agents = (
        training_launch(Path("run"), workers, SOCKETS),
        evaluation_launch(Path("run"), workers, SOCKETS, Evaluate()),
    )
    for launch in (*workers, *agents):
        assert values(launch.command, "--name") == [launch.name]
        assert values(launch.command, "--orchestrator") == ["ipc:///tmp/v/orchestrator"]


def test_a_run_has_the_same_commands_from_wherever_the_orchestrator_is_called(tmp_path, monkeypatch):
    def commands() -> list[tuple[str, ...]]:
        run = Path("../run") if Path.cwd() == tmp_path / "inside" else Path("run")
        workers = worker_launches(RunConfig(), run / "config.toml", SOCKETS)
        return [launch.command for launch in (*workers, training_launch(run, workers, SOCKETS))]

    (tmp_path / "inside").mkdir()
    monkeypatch.chdir(tmp_path)
    outside = commands()
    monkeypatch.chdir(tmp_path / "inside")
    assert commands() == outside


def test_an_evaluation_is_as_configured_unless_told_otherwise():
    workers = worker_launches(RunConfig(), CONFIG, SOCKETS)
    plain = evaluation_launch(Path("run"), workers, SOCKETS, Evaluate())
    told = evaluation_launch(Path("run"), workers, SOCKETS, Evaluate(episodes=5, policies=("stay", "random")))
    assert values(plain.command, "--policy") == values(plain.command, "--episodes") == []
    assert values(told.command, "--policy") == ["stay", "random"]
    assert values(told.command, "--episodes") == ["5"]


def test_a_folder_of_the_same_name_does_not_hide_our_module():
    assert module_command("agent", "train") == (sys.executable, "-P", "-m", "agent", "train")
