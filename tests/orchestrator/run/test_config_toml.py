from hypothesis import given
from hypothesis import strategies as st

from orchestrator.run.config_toml import resolved_toml
from orchestrator.run.run_directory import RunDirectory
from protocol.config import EvaluationConfig, PerceptionConfig, RunConfig, TrainingConfig


@given(
    seed=st.integers(0, 2**31 - 1),
    steps=st.integers(1, 10**6),
    network=st.none()
    | st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), min_size=1).map(
        lambda name: f"/models/{name}"
    ),
    baselines=st.sets(st.sampled_from(["stay", "random", "circle", "front"])),
)
def test_a_resolved_configuration_reads_back_as_it_was(tmp_path_factory, seed, steps, network, baselines):
    config = RunConfig(
        seed=seed,
        perception=PerceptionConfig(network=network),
        training=TrainingConfig(steps=steps),
        evaluation=EvaluationConfig(baselines=tuple(baselines)),
    )
    path = tmp_path_factory.mktemp("config")
    (path / "config.toml").write_bytes(resolved_toml(config))
    assert RunDirectory(path).config() == config


def test_a_resolved_configuration_has_every_default_written_out():
    text = resolved_toml(RunConfig()).decode()
    assert "[environment.camera]" in text
    assert "horizontal_fov = 70.0" in text
