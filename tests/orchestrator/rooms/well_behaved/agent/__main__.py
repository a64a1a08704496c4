import argparse
import logging
import os
import signal
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from types import FrameType

import msgspec

from protocol import Pool, Timeouts
from protocol.artifact import checksum_if_there, whole_file
from protocol.config import RunConfig
from protocol.config_file import load_config
from protocol.errors import CallFailed, VantageError
from protocol.incarnation import new_incarnation
from protocol.messages import Role, SampleScene, State, WorkerRecord
from protocol.records import Evaluation, Interval, PolicyScore, Progress, Summary
from protocol.server.registration import Registration
from protocol.system.exit_code import exit_code_of
from protocol.system.logs import configure
from protocol.system.process_start import own_start

STEP_SECONDS = 0.01
CALL_SECONDS = 2.0


class Flight:
    """Ends early on SIGTERM or as an orphan, as the real agent does."""

    def __init__(self) -> None:
        self.stopped = False
        signal.signal(signal.SIGTERM, self._stop)

    def stop(self) -> None:
        self.stopped = True

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.stop()


def checkpoint(run: Path, step: int) -> None:
    aside = run / ".checkpoint"
    aside.write_text(str(step))
    aside.replace(run / "checkpoint")


def steps_done(run: Path) -> int:
    try:
        return int((run / "checkpoint").read_text())
    except FileNotFoundError:
        return 0


def looked_at(step: int, render: Pool, flight: Flight) -> bool:
    """Have a step's scene drawn; False where nobody did and we are to end."""
    while True:
        try:
            render.call(SampleScene(seed=step, split="train"), deadline=CALL_SECONDS)
        except CallFailed:
            if flight.stopped:
                return False
        else:
            return True


def train(run: Path, config: RunConfig, render: Pool, flight: Flight) -> None:
    steps, began, step = config.training.steps, time.time(), steps_done(run)
    logging.getLogger(__name__).warning("nothing will be learned, from step %d on", step)
    with (run / "progress.jsonl").open("ab", buffering=0) as progress:
        while step < steps and not flight.stopped:
            if not looked_at(step, render, flight):
                break
            time.sleep(STEP_SECONDS)
            step += 1
            checkpoint(run, step)
            record = Progress(
                time=time.time(),
                phase="training",
                step=step,
                steps=steps,
                episodes=step,
                steps_per_second=100.0,
                process=own_start(),
            )
            progress.write(msgspec.json.encode(record) + b"\n")
    (run / "weights.safetensors").write_bytes(b"")
    summary = Summary(
        steps=step,
        episodes=step,
        updates=0,
        seconds=time.time() - began,
        steps_per_second=100.0,
        stages={"render": 0.05, "infer": 0.06},
        late_replies=0,
        retries=0,
        complete=step >= steps,
    )
    with whole_file(run / "summary.json") as aside:
        aside.write_bytes(msgspec.json.encode(summary))


def fly(run: Path, steps: int) -> None:
    with (run / "progress.jsonl").open("ab", buffering=0) as progress:
        for step in range(steps):
            time.sleep(STEP_SECONDS)
            record = Progress(
                time=time.time(),
                phase="evaluation",
                step=step,
                steps=steps,
                episodes=0,
                steps_per_second=100.0,
                process=own_start(),
            )
            progress.write(msgspec.json.encode(record) + b"\n")


def evaluate(run: Path, config: RunConfig, names: list[str] | None, flights: int | None) -> None:
    figure = Interval(0.5, 0.25, 0.75)
    policies, episodes = names or ("trained", *config.baselines), flights or config.evaluation.episodes
    fly(run, len(policies) * episodes)
    scores = tuple(
        PolicyScore(
            policy=policy,
            episodes=episodes,
            total_reward=figure,
            uncertainty=figure,
            success=figure,
            crash=figure,
            length=figure,
        )
        for policy in policies
    )
    evaluation = Evaluation(
        first_seed=config.evaluation.first_seed,
        success_threshold=1.6,
        scores=scores,
        weights=checksum_if_there(run / "weights.safetensors"),
        by=INCARNATION,
    )
    with whole_file(run / "evaluation.json") as aside:
        aside.write_bytes(msgspec.json.encode(evaluation))


def parsed_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    parser.add_argument("activity", choices=["train", "evaluate"])
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--render", action="append", default=[])
    parser.add_argument("--perception", action="append", default=[])
    parser.add_argument("--orchestrator")
    parser.add_argument("--name")
    parser.add_argument("--policy", action="append")
    parser.add_argument("--episodes", type=int)
    return parser.parse_args()


def record_of(name: str) -> WorkerRecord:
    return WorkerRecord(
        role=Role.AGENT, address="", incarnation=INCARNATION, state=State.BUSY, name=name, pid=os.getpid()
    )


INCARNATION = new_incarnation()


def main() -> None:
    options = parsed_options()
    configure("agent")
    config = load_config(options.run / "config.toml")
    timeouts = Timeouts.from_config(config.timeouts)
    flight = Flight()
    with ExitStack() as stack:
        registration = None
        if options.orchestrator:
            registration = stack.enter_context(
                Registration(
                    options.orchestrator,
                    describe=lambda: record_of(options.name),
                    on_orphaned=flight.stop,
                    timeouts=timeouts,
                )
            )
        if options.activity == "evaluate":
            evaluate(options.run, config, options.policy, options.episodes)
            return
        render = stack.enter_context(Pool(options.render, role=Role.AGENT, serves=Role.RENDER, timeouts=timeouts))
        if registration is not None:
            registration.follow(render, Role.RENDER)
        train(options.run, config, render, flight)


try:
    main()
except VantageError as error:
    logging.getLogger(__name__).error("%s", error)
    sys.exit(exit_code_of(error))
