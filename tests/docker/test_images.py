"""What the images are: small, closed, without torch but the agent's, and clear where something is missing."""

import json
import subprocess

import pytest

from tests.docker.stack import SERVICES

LARGEST = {"render": 800e6, "perception": 800e6}
CLOSED = ("--network", "none", "--read-only", "--cap-drop", "ALL", "--user", "1000", "--tmpfs", "/tmp")
CLOSED += ("--security-opt", "no-new-privileges")


def closed(engine, image: str, *words: str, options: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    """Run an image as a stranger's program would have to run."""
    return engine.run("run", "--rm", *CLOSED, *options, f"vantage-{image}", *words)


@pytest.mark.parametrize("image", LARGEST)
def test_an_image_of_a_worker_is_small(images, image):
    assert int(images.inspect(f"vantage-{image}", "{{.Size}}")) < LARGEST[image]


@pytest.mark.parametrize("image", SERVICES)
def test_an_image_runs_with_a_read_only_root_no_capability_and_as_a_common_user(images, image):
    done = closed(images, image, "--help")
    assert done.returncode == 0, done.stdout
    assert "usage" in done.stdout.lower()


@pytest.mark.parametrize("image", SERVICES)
def test_torch_is_in_the_agents_image_alone(images, image):
    find = "import importlib.util as found; print(found.find_spec('torch') is not None)"
    done = closed(images, image, "-c", find, options=("--entrypoint", "python"))
    assert done.stdout.split()[-1] == str(image == "agent")


@pytest.mark.parametrize(
    ("image", "words", "missing"),
    [
        ("render", ("--bind", "tcp://127.0.0.1:5601"), "bodies-v1.npz is missing"),
        (
            "perception",
            ("--bind", "tcp://127.0.0.1:5602", "--render", "tcp://127.0.0.1:5601"),
            "openpose_mobilenet_thin_5.onnx is missing",
        ),
    ],
)
def test_an_image_without_its_weights_says_so_and_ends(images, image, words, missing):
    done = closed(images, image, *words, options=("--tmpfs", "/opt/vantage"))
    assert done.returncode == 2
    assert missing in json.loads(done.stdout.splitlines()[-1])["message"]


@pytest.mark.parametrize(("image", "role"), [("render", "render"), ("perception", "perception")])
def test_a_worker_without_a_key_serves_no_other_machine(images, image, role):
    more = () if role == "render" else ("--render", "tcp://127.0.0.1:5601")
    done = closed(images, image, "--bind", "tcp://0.0.0.0:5601", *more)
    assert done.returncode == 2
    assert "there is no key" in done.stdout


def test_a_damaged_artifact_fails_the_build(images, tmp_path):
    """As what a build is handed that is not what set-up made."""
    (tmp_path / "openpose_mobilenet_thin.onnx").write_bytes(b"something else")
    dockerfile = "FROM vantage-perception\nCOPY openpose_mobilenet_thin.onnx /opt/vantage/\n"
    dockerfile += "RUN python -m perception_worker.networks check\n"
    (tmp_path / "Dockerfile").write_text(dockerfile)
    done = images.run("build", "--network", "none", str(tmp_path))
    assert done.returncode != 0
    assert "has the checksum" in done.stdout
