"""A training without learning: each row of its journal follows from the one before, so that none may be missing."""

import argparse
import hashlib
import logging
import os
import shutil
import signal
import time
from pathlib import Path

import msgspec

from protocol import Pool, Timeouts
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.failpoint import Failpoint, failpoint_of
from protocol.incarnation import new_incarnation
from protocol.messages import Role, SampleScene, State, WorkerRecord
from protocol.records import Progress, Summary
from protocol.server.registration import Registration
from protocol.system.logs import configure

STEP_SECONDS = 0.05
PACE = 60.0
ROW = 64


class Training:
    """Rows so far; `stopped` on SIGTERM or as an orphan."""

    def __init__(self, run: Path, config: RunConfig, reach: Failpoint, step_seconds: float) -> None:
        self.stopped = False
        self._run = run
        self._steps = config.training.steps
        self._every = config.training.checkpoint_every
        self._drones = config.environment.num_envs
        self._reach = reach
        self._step_seconds = step_seconds
        self._rows: list[bytes] = []
        self._written = 0

    def restore(self, *, cut_back: bool) -> None:
        found = sorted((self._run / "checkpoints").glob("step-*"))
        flown = int(found[-1].name.removeprefix("step-")) if found else 0
        path = self._run / "replay" / "000000.bin"
        path.parent.mkdir(exist_ok=True)
        with path.open("ab") as file:
            if cut_back:
                file.truncate(flown // self._drones * ROW)
        data = path.read_bytes()[: flown // self._drones * ROW]
        self._rows = [data[at : at + ROW] for at in range(0, len(data), ROW)]
        self._written = len(self._rows)

    @property
    def flown(self) -> int:
        return len(self._rows) * self._drones

    def fly(self, render: Pool) -> None:
        self._tell("training")
        while self.flown < self._steps and not self.stopped:
            self._reach(f"step-{self.flown}")
            render.call(SampleScene(seed=self.flown, split="train"))
            time.sleep(self._step_seconds)
            self._rows.append(hashlib.sha512(self._rows[-1] if self._rows else b"").digest())
            self._tell("training")
            if self.flown // self._every > (self.flown - self._drones) // self._every:
                self._keep()

    def end(self) -> None:
        self._keep()
        complete = self.flown >= self._steps
        (self._run / "weights.safetensors").write_bytes(hashlib.sha256(b"".join(self._rows)).digest())
        (self._run / "episodes.jsonl").write_bytes(b'{"number":0}\n')
        summary = Summary(
            steps=self.flown,
            episodes=1,
            updates=0,
            seconds=1.0,
            steps_per_second=PACE,
            stages={},
            late_replies=0,
            retries=0,
            complete=complete,
        )
        (self._run / "summary.json").write_bytes(msgspec.json.encode(summary))
        self._tell("done" if complete else "training")

    def _keep(self) -> None:
        place = self._run / "checkpoints" / f"step-{self.flown:09d}"
        aside = place.with_name(f".{place.name}.{os.getpid()}")
        aside.mkdir(parents=True)
        self._reach("checkpoint-opened")
        with (self._run / "replay" / "000000.bin").open("ab") as file:
            file.write(b"".join(self._rows[self._written :]))
        self._written = len(self._rows)
        self._reach("checkpoint-journal-synced")
        (aside / "manifest.json").write_bytes(b"{}")
        self._reach("checkpoint-written")
        self._reach("checkpoint-manifest-written")
        if not place.exists():
            aside.rename(place)
        self._reach("checkpoint-renamed")
        shutil.rmtree(aside, ignore_errors=True)
        self._reach("checkpoint-pruned")

    def _tell(self, phase: str) -> None:
        record = {"time": time.time(), "phase": phase, "step": self.flown, "steps": self._steps, "episodes": 0}
        record["steady"] = time.monotonic()
        progress = msgspec.convert(record | {"steps_per_second": PACE}, Progress)
        with (self._run / "progress.jsonl").open("ab") as file:
            file.write(msgspec.json.encode(progress) + b"\n")


def main(*, cut_back: bool, step_seconds: float = STEP_SECONDS) -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("activity", choices=["train"])
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--render", action="append", required=True)
    parser.add_argument("--perception", action="append", required=True)
    parser.add_argument("--orchestrator", required=True)
    parser.add_argument("--name", required=True)
    options = parser.parse_args()
    configure("agent")
    config = load_config(options.run / "config.toml")
    timeouts = Timeouts.from_config(config.timeouts)
    training = Training(options.run, config, failpoint_of(os.environ), step_seconds)
    incarnation = new_incarnation()

    def stop(*_: object) -> None:
        training.stopped = True

    def record() -> WorkerRecord:
        about = {"role": Role.AGENT, "address": "", "state": State.BUSY}
        return WorkerRecord(**about, incarnation=incarnation, name=options.name, pid=os.getpid())

    signal.signal(signal.SIGTERM, stop)
    training.restore(cut_back=cut_back)
    logging.getLogger(__name__).info("going on after %d steps", training.flown)
    with (
        Registration(options.orchestrator, describe=record, on_orphaned=stop, timeouts=timeouts),
        Pool(options.render, role=Role.AGENT, serves=Role.RENDER, timeouts=timeouts) as render,
    ):
        render.wait_ready()
        training.fly(render)
        training.end()
