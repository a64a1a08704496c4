"""The command within the tests' process, and a configuration to start it on."""

import pytest
from typer.testing import CliRunner

from orchestrator.cli.app import app

SHORT = "[training]\nsteps = 20\n[evaluation]\nepisodes = 3\nbaselines = ['stay']\n"
LONG = "[training]\nsteps = 1000000\n"


@pytest.fixture
def config(orchestrator):
    def write(text: str) -> str:
        path = orchestrator.folder / "short.toml"
        path.write_text(text)
        return str(path)

    return write


@pytest.fixture
def invoke(monkeypatch, tmp_path):
    """Calls the command within this process: for what ends before it starts any other."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VANTAGE_CACHE", str(tmp_path / "cache"))
    return lambda *arguments: CliRunner().invoke(app, list(arguments))
