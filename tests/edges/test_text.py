"""Bytes that are no UTF-8, in and out: in configurations, records, logs, names of files, and on terminals."""

import io
import json
import logging
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from orchestrator.cli.app import app
from orchestrator.monitoring.status import run_status
from orchestrator.run.json_lines import all_records, append_record, last_record
from orchestrator.run.restart import Restart
from orchestrator.run.run_directory import RunDirectory
from orchestrator.run.socket_directory import run_sockets
from orchestrator.run.versions import collect_versions
from orchestrator.supervision.log_line import parse_log_line
from orchestrator.supervision.log_warnings import LogWarnings
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.errors import InvalidConfig, NotPermitted, Unavailable
from protocol.failure import failure_of
from protocol.security.allow_list import read_allow_list
from protocol.system.logs import JsonLines, json_lines_to

TEXT = "# Größe\n[training]\nsteps = 20\n"
OTHER_ENCODINGS = {name: TEXT.encode(name) for name in ("utf-16", "utf-16-le", "utf-16-be", "utf-32", "latin-1")}
NESTED = b"seed = " + 5000 * b"["
READS_A_CONFIGURATION = [
    ("train",),
    ("chaos",),
    ("view", "1", "--config"),
    ("experiment", "qoe"),
    ("lifter", "fit"),
]
LATIN_1_NAME = os.fsdecode(b"caf\xe9")
BAD_LINE = b'{"time": 1.0, "level": "warning", "message": "caf\xe9 can\'t be read"}\n'


@pytest.mark.parametrize("arguments", READS_A_CONFIGURATION, ids=" ".join)
@pytest.mark.parametrize("encoding", OTHER_ENCODINGS)
def test_a_configuration_in_another_encoding_is_said_to_be_so(tmp_path, monkeypatch, arguments, encoding):
    monkeypatch.chdir(tmp_path)
    Path("c.toml").write_bytes(OTHER_ENCODINGS[encoding])
    done = CliRunner().invoke(app, [*arguments, "c.toml"])
    assert (done.exit_code, "c.toml is not UTF-8" in done.stderr) == (2, True), done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_byte_order_mark_is_no_part_of_a_configuration(tmp_path):
    (tmp_path / "c.toml").write_bytes(TEXT.encode("utf-8-sig"))
    assert load_config(tmp_path / "c.toml").training.steps == 20


def test_a_configuration_that_nests_without_end_is_refused_in_a_sentence(tmp_path):
    (tmp_path / "c.toml").write_bytes(NESTED)
    with pytest.raises(InvalidConfig, match=r"c\.toml"):
        load_config(tmp_path / "c.toml")


@pytest.mark.parametrize("content", [*OTHER_ENCODINGS.values(), 100_000 * b"[", b'"\xe9"'])
class TestRecords:
    """Whatever bytes are in a file of records, it is read as damaged and not died of."""

    def test_of_a_run_are_passed_over(self, finished_run, content):
        told = [finished_run.path / name for name in ("config.toml", "plan.json", "versions.json")]
        for path in finished_run.path.iterdir():
            if path.is_file() and path not in told:
                path.write_bytes(content)
        for path in (finished_run.workers_path, finished_run.restarts_path, finished_run.ending_path):
            path.write_bytes(content + b"\n")
        status = run_status(finished_run)
        assert (status.state, status.progress, status.summary, status.evaluation) == ("broken off", None, None, None)

    @pytest.mark.parametrize("name", ["config.toml", "plan.json", "versions.json"])
    def test_that_tell_a_run_what_to_do_are_damaged(self, finished_run, content, name):
        (finished_run.path / name).write_bytes(content)
        status = run_status(finished_run)
        assert (status.state, name in str(status.reason)) == ("damaged", True)

    def test_in_lines_are_passed_over(self, tmp_path, content):
        path = tmp_path / "lines.jsonl"
        path.write_bytes(content.replace(b"\n", b"") + b"\n")
        assert last_record(path, Restart) is None
        restart = Restart(time=1.0, process="a", reason="b", planned=False)
        append_record(path, restart)
        assert list(all_records(path, Restart)) == [restart]

    def test_of_keys_are_refused_by_name(self, tmp_path, content):
        (tmp_path / "allowed.json").write_bytes(content)
        with pytest.raises(NotPermitted, match=r"allowed\.json"):
            read_allow_list(tmp_path / "allowed.json")


class TestLogLines:
    @pytest.mark.parametrize("line", [BAD_LINE, b"\xff\xfe\x00", 100_000 * b"[", b'{"message": "\xe9'])
    def test_any_bytes_are_a_line(self, line):
        assert parse_log_line(line).message.isprintable()

    def test_one_bad_byte_costs_neither_the_level_nor_the_other_letters(self):
        line = parse_log_line(BAD_LINE)
        assert (line.level, line.message) == ("warning", "caf� can't be read")

    def test_a_line_can_not_do_anything_to_the_terminal(self):
        line = rb'{"message": "\u001b[2J\u001b]0;title\u0007gone\r\n", "level": "error"}'
        assert parse_log_line(line).message == "[2J ]0;title gone"

    def test_a_warning_with_a_bad_byte_is_shown(self, tmp_path):
        (tmp_path / "a.jsonl").write_bytes(BAD_LINE)
        warnings = LogWarnings()
        warnings.follow_file("render-0", tmp_path / "a.jsonl", 0)
        assert warnings.last() == "render-0: caf� can't be read"

    def test_a_name_that_is_no_utf_8_can_be_logged(self):
        record = logging.makeLogRecord({"msg": "no %s", "args": (LATIN_1_NAME,), "path": Path(LATIN_1_NAME)})
        assert json.loads(JsonLines("render").format(record))["message"] == "no caf?"

    def test_a_log_is_utf_8_wherever_it_is_written(self):
        written = io.BytesIO()
        handler = json_lines_to(io.TextIOWrapper(written, encoding="latin-1"), "render")
        handler.emit(logging.makeLogRecord({"msg": "café → bar"}))
        assert json.loads(written.getvalue())["message"] == "café → bar"


class TestNames:
    def test_a_run_may_have_a_name_that_is_no_utf_8(self, tmp_path):
        run = RunDirectory.create(tmp_path / LATIN_1_NAME, RunConfig(), collect_versions({}))
        with run_sockets(run.path) as sockets:
            assert sockets.is_dir()
        done = CliRunner().invoke(app, ["status", str(run.path), "--json"])
        assert done.exit_code == 0, done.stderr
        assert json.loads(done.stdout)["run"].endswith("caf?")
        assert run.name == "caf?"

    def test_an_error_about_such_a_name_can_be_sent(self):
        assert failure_of(Unavailable(f"can't read {LATIN_1_NAME}")).message == "can't read caf?"

    @pytest.mark.parametrize("name", [LATIN_1_NAME, "日本", "a\nb", "\x1b[2J"])
    def test_a_file_of_any_name_that_is_not_there_is_said_to_be_so(self, name, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        for arguments in (["train", name], ["status", name], ["resume", name], ["calibration", "show", name]):
            done = CliRunner().invoke(app, arguments)
            assert done.exit_code in (1, 2)
            assert not isinstance(done.exception, UnicodeError)


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "cp1252", "utf-8"])
def test_what_a_terminal_can_not_show_is_replaced(encoding):
    program = """
from protocol.system.streams import prepared_streams
from orchestrator.doctor import Check, checks_table
from orchestrator.terminal.output import print_json, print_line, show
check = Check(name="a", passed=False, found="日本 · café", remedy="é → é")
with prepared_streams():
    show(checks_table([check]))
    print_line("日本")
    print_json(check)
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
        capture_output=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    table, _, written = done.stdout.partition(b"{")
    assert b"FAILED" in table.decode(encoding).encode()
    assert json.loads(b"{" + written)["found"] == "日本 · café"


@pytest.mark.slow
@pytest.mark.parametrize("charmap", ["ISO-8859-1", "ANSI_X3.4-1968"])
def test_under_a_locale_of_another_encoding_commands_speak(tmp_path, charmap, command, finished_run):
    made = subprocess.run(
        ["localedef", "-i", "en_US", "-f", charmap, tmp_path / "en_US"], check=False, capture_output=True
    )
    if made.returncode not in (0, 1) or not (tmp_path / "en_US").is_dir():
        pytest.skip(f"not run: no locale of {charmap} can be made here")
    locale = {"LOCPATH": str(tmp_path), "LC_ALL": "en_US", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = command("status", finished_run.path, environment=locale)
    assert (done.returncode, b"finished" in done.stdout) == (0, True), done.stderr
    odd = command("train", b"caf\xe9\xff.toml", environment=locale)
    assert (odd.returncode, b"Traceback" in odd.stderr) == (2, False), odd.stderr


@pytest.mark.slow
def test_a_training_in_a_directory_whose_name_is_no_utf_8_comes_to_its_end(orchestrator):
    (orchestrator.folder / "c.toml").write_text("[training]\nsteps = 20\n[evaluation]\nepisodes = 3\nbaselines = []\n")
    done = orchestrator.run("train", "c.toml", "--run", LATIN_1_NAME, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["run"] == "caf?"
    again = orchestrator.run("resume", LATIN_1_NAME, "--json")
    assert (again.returncode, json.loads(again.stdout)) == (0, json.loads(done.stdout))
    assert "finished" in orchestrator.run("status", LATIN_1_NAME).stdout
