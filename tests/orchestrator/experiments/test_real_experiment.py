"""The command with real renders and the real network: stopped, killed, gone on with."""

import json
import signal

import msgspec
import pyarrow.parquet as pq
import pytest
from msgspec.structs import replace

from orchestrator.experiments.directory import ExperimentDirectory
from orchestrator.experiments.views import FAMILIES
from perception_worker.networks.network_setting import network_setting
from protocol.config import PerceptionConfig, settled
from tests.perception_worker.lifter.bodies import stored
from tests.protocol.security.deployment import free_port

pytestmark = pytest.mark.slow

PATIENCE = 240.0
CONFIG = "[environment.camera]\nwidth = 320\nheight = 240\n"
SMALL = ("experiment", "qoe", "small.toml", "--frames", "12", "--workers", "1", "--frames-a-part", "4")


def test_a_killed_experiment_goes_on_to_the_table_of_an_uninterrupted_one(orchestrator, wait_until):
    (orchestrator.folder / "small.toml").write_text(CONFIG)
    killed = ExperimentDirectory(orchestrator.folder / "killed")
    parts = killed.table_path.with_suffix(".parts")
    child = orchestrator.start(*SMALL, "--out", "killed", rooms=None)
    wait_until(lambda: (parts / "part-00000.parquet").exists())
    child.kill()
    child.communicate(timeout=PATIENCE)
    begun = (parts / "part-00000.parquet").stat().st_mtime_ns
    assert not killed.table_path.exists()

    child = orchestrator.start(*SMALL, "--out", "killed", rooms=None)
    wait_until(lambda: (parts / "part-00001.parquet").exists())
    assert (parts / "part-00000.parquet").stat().st_mtime_ns == begun
    child.send_signal(signal.SIGINT)
    _, words = child.communicate(timeout=PATIENCE)
    assert (child.returncode, "the same command continues" in words) == (130, True), words

    more = [word if word != "1" else "2" for word in SMALL]
    done = orchestrator.run(*more, "--out", "killed", "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["qoe"]["frames"] == 12
    uninterrupted = orchestrator.run(*SMALL, "--out", "uninterrupted", rooms=None, patience=PATIENCE)
    assert uninterrupted.returncode == 0, uninterrupted.stderr
    assert killed.table_path.read_bytes() == (orchestrator.folder / "uninterrupted" / "qoe.parquet").read_bytes()
    assert not parts.exists()
    table = pq.read_table(killed.table_path)
    assert table.num_rows == 12 * 2 * 18
    assert table["located"].to_numpy().mean() > 0.3


def test_another_experiment_in_the_same_directory_is_refused_before_anything_starts(orchestrator):
    first = orchestrator.run("experiment", "qoe", "--frames", "1", "--noise", "none", "--out", "e", rooms=None)
    assert first.returncode == 0, first.stderr
    other = orchestrator.run("experiment", "qoe", "--frames", "1", "--seed", "1", "--out", "e", rooms=None)
    assert other.returncode == 2
    assert "other views" in other.stderr


def test_families_of_poses_are_observed_in_turn_and_named_in_the_table(orchestrator):
    (orchestrator.folder / "small.toml").write_text(CONFIG)
    options = (*SMALL[:4], "5", "--workers", "1", "--noise", "none", "--poses", "families", "--views-a-scene", "1")
    done = orchestrator.run(*options, "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["qoe"]["frames"] == 5
    table = pq.read_table(orchestrator.folder / "runs" / "experiments" / "qoe-test-0-families" / "qoe.parquet")
    assert tuple(table["poses"].to_pylist()[::18]) == FAMILIES
    assert set(table["pose"].to_pylist()) == {0}
    assert table["identity"].to_pylist()[::18] == [40, 41, 42, 43, 44]


def test_flights_of_an_experiment_carry_the_filter_and_end_in_the_same_table_when_killed(orchestrator, wait_until):
    (orchestrator.folder / "small.toml").write_text(CONFIG)
    begun = orchestrator.run(*SMALL, "--noise", "none", "--out", "e", rooms=None, patience=PATIENCE)
    assert begun.returncode == 0, begun.stderr
    flights = ("experiment", "flights", "e", "--scenes", "3", "--steps", "4", "--workers", "1")
    table = orchestrator.folder / "e" / "flights.parquet"
    child = orchestrator.start(*flights, rooms=None)
    wait_until(lambda: any(table.with_suffix(".parts").glob("part-*")))
    child.kill()
    child.communicate(timeout=PATIENCE)
    done = orchestrator.run(*flights, "--json", rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["flights"]["flights"] == 6
    resumed = table.read_bytes()
    table.unlink()
    assert orchestrator.run(*flights, rooms=None, patience=PATIENCE).returncode == 0
    assert table.read_bytes() == resumed
    flown = pq.read_table(table).to_pydict()
    rows = zip(flown["step"], flown["seen"], flown["deviation"], strict=True)
    first, last = ([], [])
    for step, seen, deviation in rows:
        if seen and step in (0, 3):
            (first if step == 0 else last).append(deviation)
    assert sum(last) / len(last) < sum(first) / len(first)


def test_a_learned_lifter_is_observed_and_flown_with(orchestrator):
    setting = network_setting(settled(PerceptionConfig(), "vantage"))
    untrained = replace(stored(), setting=setting)
    (orchestrator.folder / "untrained.msgpack").write_bytes(msgspec.msgpack.encode(untrained))
    (orchestrator.folder / "small.toml").write_text(f'{CONFIG}[perception]\nlifter = "untrained.msgpack"\n')
    observed = orchestrator.run(*SMALL, "--noise", "none", "--out", "e", "--json", rooms=None, patience=PATIENCE)
    assert observed.returncode == 0, observed.stderr
    qoe = json.loads(observed.stdout)["qoe"]
    assert qoe["lifting"] == "learned"
    by_sort = {one["sort"]: one["joints"] for one in qoe["lifted"] if one["group"] == "all"}
    assert by_sort["all"] == by_sort["seen"] + by_sort["inferred"]
    assert min(by_sort.values()) > 0
    flights = ("experiment", "flights", "e", "--scenes", "2", "--steps", "2", "--workers", "1", "--json")
    flown = orchestrator.run(*flights, rooms=None, patience=PATIENCE)
    assert flown.returncode == 0, flown.stderr
    assert json.loads(flown.stdout)["flights"]["lifting"] == "learned"
    table = pq.read_table(orchestrator.folder / "e" / "flights.parquet").to_pydict()
    rows = zip(table["located"], table["detected"], table["seen"], table["step"], strict=True)
    told = {(detected, seen) for located, detected, seen, step in rows if located and step == 0}
    # By its variance an inferred joint tells the filter as well.
    assert told == {(True, True), (False, True)}
    assert {posterior["within"]["value"] <= 1.0 for posterior in json.loads(flown.stdout)["flights"]["posteriors"]} == {
        True
    }


def test_an_experiment_works_with_the_workers_of_a_host_and_lets_them_go(orchestrator):
    address = f"tcp://127.0.0.1:{free_port()}"
    children = [orchestrator.start("host", "--bind", address, rooms=None)]
    for role in ("render", "perception"):
        options = ("--bind", f"tcp://127.0.0.1:{free_port()}", "--orchestrator", address, "--name", f"{role}-0")
        children.append(orchestrator.start(*options, rooms=None, module=f"{role}_worker"))
    options = ("experiment", "qoe", "--frames", "3", "--out", "e", "--join", address)
    done = orchestrator.run(*options, rooms=None, patience=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert pq.read_table(orchestrator.folder / "e" / "qoe.parquet").num_rows == 3 * 2 * 18
    for child in children:
        _, words = child.communicate(timeout=PATIENCE)
        assert child.returncode == 0, words
