import pytest


@pytest.mark.slow
def test_view_draws_a_page_for_each_scene(orchestrator):
    done = orchestrator.run("view", "3", "4", "--angle", "20", "--output", "pictures")
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["pictures/scene-3.png", "pictures/scene-4.png"]
    assert all((orchestrator.folder / path).stat().st_size > 10_000 for path in done.stdout.split())
