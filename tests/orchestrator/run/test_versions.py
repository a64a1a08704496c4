import subprocess
from importlib.metadata import version

import msgspec

from orchestrator.run.versions import collect_versions, installed_version, requirements, source_commit


def test_versions_name_our_packages_and_what_the_processes_are_given():
    versions = collect_versions({"OMP_NUM_THREADS": "1"})
    assert versions.packages["numpy"] == version("numpy")
    assert versions.environment == {"OMP_NUM_THREADS": "1"}
    assert msgspec.json.decode(versions.to_json())["protocol"] == versions.protocol


def test_every_room_declares_what_it_needs():
    names = {requirement.name for requirement in requirements()}
    assert {"numpy", "moderngl", "openvino", "torch", "typer"} <= names


def test_a_package_that_is_not_installed_has_no_version():
    assert installed_version("no-such-package-at-all") is None


def test_a_commit_is_known_in_a_checkout_only(tmp_path):
    assert source_commit(tmp_path) is None
    git = ["git", "-C", str(tmp_path), "-c", "user.name=x", "-c", "user.email=x@example.org"]
    subprocess.run([*git, "init", "-q"], check=True)
    (tmp_path / "file").write_text("one")
    subprocess.run([*git, "add", "file"], check=True)
    subprocess.run([*git, "commit", "-q", "-m", "Begin"], check=True)
    commit = source_commit(tmp_path)
    assert commit is not None
    assert len(commit) == 40
    (tmp_path / "file").write_text("two")
    assert source_commit(tmp_path) == f"{commit}-dirty"
