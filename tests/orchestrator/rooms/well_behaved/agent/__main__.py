import argparse
import logging
import signal
import time
from pathlib import Path
from types import FrameType

import msgspec

from protocol import Pool
from protocol.config import RunConfig, load_config
from protocol.logs import configure
from protocol.messages import Role, SampleScene
from protocol.records import Evaluation, Interval, PolicyScore, Progress, Summary

STEP_SECONDS = 0.01


class Flight:
    """Ends early on SIGTERM, as the real agent does."""

    def __init__(self) -> None:
        self.stopped = False
        signal.signal(signal.SIGTERM, self._stop)

    def _stop(self, _number: int, _frame: FrameType | None) -> None:
        self.stopped = True


def train(run: Path, config: RunConfig, render: Pool) -> None:
    flight, steps, began = Flight(), config.training.steps, time.time()
    logging.getLogger(__name__).warning("nothing will be learned")
    step = 0
    with (run / "progress.jsonl").open("ab", buffering=0) as progress:
        while step < steps and not flight.stopped:
            render.call(SampleScene(seed=step, split="train"))
            time.sleep(STEP_SECONDS)
            step += 1
            record = Progress(
                time=time.time(), phase="training", step=step, steps=steps, episodes=step, steps_per_second=100.0
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
    )
    (run / "summary.json").write_bytes(msgspec.json.encode(summary))


def evaluate(run: Path, config: RunConfig, policies: list[str] | None, episodes: int | None) -> None:
    figure = Interval(0.5, 0.25, 0.75)
    scores = tuple(
        PolicyScore(
            policy=policy,
            episodes=episodes or config.evaluation.episodes,
            total_reward=figure,
            uncertainty=figure,
            success=figure,
            crash=figure,
            length=figure,
        )
        for policy in policies or ("trained", *config.evaluation.baselines)
    )
    evaluation = Evaluation(first_seed=config.evaluation.first_seed, success_threshold=1.6, scores=scores)
    (run / "evaluation.json").write_bytes(msgspec.json.encode(evaluation))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("activity", choices=["train", "evaluate"])
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--render", action="append", required=True)
    parser.add_argument("--perception", action="append", required=True)
    parser.add_argument("--policy", action="append")
    parser.add_argument("--episodes", type=int)
    options = parser.parse_args()
    configure("agent")
    config = load_config(options.run / "config.toml")
    if options.activity == "evaluate":
        evaluate(options.run, config, options.policy, options.episodes)
        return
    with Pool(options.render, role=Role.AGENT, serves=Role.RENDER) as render:
        train(options.run, config, render)


main()
