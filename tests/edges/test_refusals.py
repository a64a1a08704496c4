"""What the operating system refuses: read-only disks, no locks, no rights, no home. People are told in a sentence."""

import errno
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import msgspec
import pytest
from typer.testing import CliRunner

from orchestrator import training
from orchestrator.cli.app import app
from orchestrator.doctor import done as checked
from orchestrator.doctor.machine import check_cache, check_files
from orchestrator.errors import RunError
from orchestrator.monitoring.status import run_status
from orchestrator.run.run_directory import Plan
from orchestrator.run.run_log import log_directory, run_log
from perception_worker.networks.models import OPENPOSE_MOBILENET_THIN_5
from protocol.artifact import cache_directory, require_place
from protocol.errors import Interrupted
from protocol.system.home import home_at_hand, home_directory

NOBODYS_NUMBER = "12345"
SHORT = "[training]\nsteps = 20\n"
OUTPUTS = [
    ("view", "1", "--output", "PLACE/a.png"),
    ("view", "1", "2", "--output", "PLACE/pictures"),
    ("calibration", "fit", "TABLE", "PLACE/a.msgpack"),
    ("lifter", "fit", "CONFIG", "--out", "PLACE/lifter"),
    ("experiment", "qoe", "CONFIG", "--out", "PLACE/qoe"),
    ("train", "CONFIG", "--run", "PLACE/run"),
    ("chaos", "CONFIG", "--runs", "PLACE/chaos"),
    ("keys", "new", "a", "--role", "render", "--dir", "PLACE/keys"),
]
"""Every command that writes where it is told; a new one gets its row here."""


@pytest.fixture
def invoke(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, list(map(str, arguments)))


@pytest.fixture
def read_only():
    """What comes before a command for which a directory is read-only, also for root."""
    program = 'mount --bind "$0" "$0" && mount -o remount,ro,bind "$0" && exec "$@"'

    def before(directory: Path) -> tuple[str, ...]:
        return "unshare", "--mount", "--map-root-user", "sh", "-c", program, str(directory)

    with tempfile.TemporaryDirectory() as directory:
        if subprocess.run([*before(Path(directory)), "true"], check=False, capture_output=True).returncode != 0:
            pytest.skip("not run: no mount namespace can be made here")
    return before


@pytest.fixture
def without_locks(monkeypatch, request, finished_run):
    """A file system that has no `flock`, as some that come over a network, with a finished run on it."""

    def flock(_descriptor: int, _operation: int) -> None:
        raise OSError(request.param, os.strerror(request.param))

    monkeypatch.setattr(fcntl, "flock", flock)


def is_a_sentence(stderr: str | bytes) -> bool:
    text = stderr if isinstance(stderr, str) else stderr.decode()
    return "Traceback" not in text and len(text.strip().splitlines()) == 1


@pytest.mark.slow
class TestReadOnlyMount:
    @pytest.mark.parametrize("arguments", [("status",), ("status", "--json"), ("resume",), ("resume", "--json")])
    def test_a_finished_run_can_be_read(self, command, finished_run, read_only, arguments):
        name, *options = arguments
        done = command(name, finished_run.path, *options, before=read_only(finished_run.path))
        assert (done.returncode, done.stderr) == (0, b"")
        assert b"4000" in done.stdout

    def test_evaluate_says_what_it_can_not_write(self, command, finished_run, read_only):
        done = command("evaluate", finished_run.path, before=read_only(finished_run.path))
        assert (done.returncode, is_a_sentence(done.stderr)) == (1, True), done.stderr
        assert b"can't be written to" in done.stderr
        assert b"evaluation.json" in done.stderr

    def test_a_run_that_is_not_finished_can_not_be_gone_on_with(self, command, finished_run, read_only):
        finished_run.summary_path.unlink()
        assert b"broken off" in command("status", finished_run.path, before=read_only(finished_run.path)).stdout
        done = command("resume", finished_run.path, before=read_only(finished_run.path))
        assert (done.returncode, is_a_sentence(done.stderr)) == (1, True), done.stderr

    @pytest.mark.parametrize("arguments", OUTPUTS, ids=" ".join)
    def test_output_is_refused_before_anything_starts(self, command, tmp_path, read_only, arguments):
        place, config = tmp_path / "place", tmp_path / "c.toml"
        place.mkdir()
        config.write_text(SHORT)
        told = [
            str(config) if one == "CONFIG" else one.replace("PLACE", str(place)).replace("TABLE", "/no/such/table")
            for one in arguments
        ]
        done = command(*told, before=read_only(place), environment={"TMPDIR": str(tmp_path)})
        assert done.returncode == 1
        assert b"Traceback" not in done.stderr
        assert b"Read-only file system" in done.stderr.splitlines()[-1]
        assert b"waiting for" not in done.stderr

    def test_the_cache_may_be_read_only(self, command, tmp_path, read_only):
        cache = tmp_path / "cache"
        cache.mkdir()
        program = "from orchestrator.run.run_log import log_directory; print(log_directory())"
        done = subprocess.run(
            [*read_only(cache), sys.executable, "-c", program],
            env={**os.environ, "VANTAGE_CACHE": str(cache), "TMPDIR": str(tmp_path)},
            capture_output=True,
            check=True,
        )
        assert done.stdout.startswith(bytes(tmp_path / "vantage-logs-"))


@pytest.mark.parametrize("without_locks", [errno.ENOSYS, errno.ENOLCK, errno.EBADF], indirect=True)
@pytest.mark.usefixtures("without_locks")
class TestNoLocks:
    @pytest.mark.parametrize("name", ["status", "resume"])
    def test_reading_a_finished_run_needs_none(self, invoke, finished_run, name):
        done = invoke(name, finished_run.path)
        assert (done.exit_code, "4000 steps" in done.stdout) == (0, True), done.stderr

    def test_a_run_that_can_not_be_locked_is_not_made(self, invoke, tmp_path):
        (tmp_path / "c.toml").write_text(SHORT)
        done = invoke("train", "c.toml", "--run", "one")
        assert (done.exit_code, is_a_sentence(done.stderr)) == (1, True), done.stderr
        assert (
            "has no locks, and two orchestrators could work on it at once; choose a place on a local disk"
            in done.stderr
        )
        assert not (tmp_path / "one").exists()

    def test_the_doctor_finds_it(self, tmp_path):
        check = checked("files", lambda: check_files(tmp_path / "runs"))
        assert (check.passed, "has no locks" in check.found) == (False, True)


class TestFiles:
    def test_a_place_that_can_be_written_to_is_left_as_it_was(self, tmp_path):
        require_place(tmp_path / "new" / "folder" / "a.png")
        assert list(tmp_path.iterdir()) == []

    @pytest.mark.parametrize("place", ["/proc/a.png", "/dev/null/a.png", "/tmp"])
    def test_a_place_that_can_not_is_named_as_it_was_asked_for(self, place):
        with pytest.raises(OSError, match=place):
            require_place(Path(place))

    @pytest.mark.parametrize(
        "name", ["a" * 300, "link", "file/in-a-file"], ids=["too long", "a link to itself", "below a file"]
    )
    @pytest.mark.parametrize(
        "arguments", [("train",), ("status",), ("resume",), ("evaluate",), ("keys", "list", "--dir")]
    )
    def test_a_name_that_the_system_does_not_take_is_a_sentence(self, invoke, tmp_path, arguments, name):
        (tmp_path / "link").symlink_to("link")
        (tmp_path / "file").touch()
        done = invoke(*arguments, name)
        assert done.exit_code in (1, 2)
        assert is_a_sentence(done.stderr), done.stderr


class TestTracebacks:
    def test_of_what_ends_a_run_are_in_its_log_alone(self, tmp_path):
        log = tmp_path / "logs" / "orchestrator.jsonl"
        with pytest.raises(OSError, match="Input/output"), run_log(log):
            raise OSError(errno.EIO, "Input/output error", "weights")
        (line,) = [msgspec.json.decode(line) for line in log.read_bytes().splitlines()]
        assert "Traceback" in line["exception"]

    @pytest.mark.parametrize("error", [RunError("it is damaged"), Interrupted("stopped on request")])
    def test_of_our_own_errors_there_are_none(self, tmp_path, error):
        log = tmp_path / "logs" / "orchestrator.jsonl"
        with pytest.raises(type(error)), run_log(log):
            raise error
        assert b"Traceback" not in log.read_bytes()

    @pytest.mark.parametrize(
        ("error", "said"),
        [
            (OSError(errno.ENOSPC, "No space left on device", "runs/one"), "runs/one: No space left on device; free"),
            (OSError(errno.EMFILE, "Too many open files"), "ulimit -n"),
            (MemoryError(), "no memory is left; free some memory"),
            (KeyError("x"), "this is a bug: please report it with the traceback in"),
        ],
    )
    def test_whatever_ends_a_command_is_one_sentence(self, invoke, finished_run, monkeypatch, error, said):
        def fail(*_arguments: object, **_options: object) -> None:
            raise error

        monkeypatch.setattr(training, "resume", fail)
        done = invoke("resume", finished_run.path)
        assert (done.exit_code, is_a_sentence(done.stderr)) == (1, True), done.stderr
        assert said in done.stderr


class TestNoHome:
    @pytest.fixture(autouse=True)
    def _nobody(self, monkeypatch):
        monkeypatch.delenv("HOME", raising=False)
        monkeypatch.delenv("VANTAGE_CACHE", raising=False)
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        monkeypatch.setattr(os, "getuid", lambda: int(NOBODYS_NUMBER))

    def test_the_doctor_says_that_there_is_no_place_for_a_cache(self):
        check = checked("cache", check_cache)
        assert (check.passed, "VANTAGE_CACHE" in check.remedy) == (False, True)

    def test_libraries_get_one_for_as_long_as_they_are_loaded(self):
        with home_at_hand():
            home = home_directory()
            assert home is not None
            assert home.is_dir()
        assert home_directory() is None
        assert not home.exists()


@pytest.mark.slow
def test_a_user_whom_nobody_knows_can_perceive():
    """A container that is run under any number: no entry in passwd, no HOME, and the cache named."""
    network = cache_directory() / f"{OPENPOSE_MOBILENET_THIN_5.name}.onnx"
    as_nobody = ["setpriv", "--reuid", NOBODYS_NUMBER, "--regid", NOBODYS_NUMBER, "--clear-groups"]
    if subprocess.run([*as_nobody, sys.executable, "-c", "import msgspec"], check=False).returncode != 0:
        pytest.skip("not run: nobody can be become here, or may not read this environment")
    if not network.is_file():
        pytest.skip("not run: the network was not pulled")
    with tempfile.TemporaryDirectory() as cache:
        Path(cache).chmod(0o755)
        shutil.copy(network, cache)
        environment = {
            "PATH": os.environ["PATH"],
            "PYTHONPATH": os.environ.get("PYTHONPATH", ""),
            "VANTAGE_CACHE": cache,
        }
        done = subprocess.run(
            [*as_nobody, sys.executable, "-P", "-m", "perception_worker.probe"],
            env=environment,
            capture_output=True,
            check=False,
            cwd="/",
            timeout=120,
        )
    assert done.returncode == 0, done.stderr
    assert b"perceives pictures" in done.stdout


def test_a_run_that_nobody_may_write_to_has_a_status(finished_run):
    (finished_run.path / "plan.json").write_bytes(msgspec.json.encode(Plan(evaluate=False)))
    assert run_status(finished_run).state == "finished"
    assert log_directory().name
