"""The records that a training writes into its run directory: one JSON object a line or a file.

The agent writes them, the orchestrator and people read them; a run resumes without them.
"""

from typing import Literal, TypeAlias

from msgspec import Struct

from protocol.system.process_start import ProcessStart

Outcome: TypeAlias = Literal["flying", "truncated", "too_close", "out_of_workspace", "succeeded"]
Phase: TypeAlias = Literal["prefill", "training", "evaluation", "done"]
Stage: TypeAlias = Literal["render", "infer", "decode", "lift", "qoe", "filter", "transport", "learn"]


class Progress(Struct, frozen=True, kw_only=True):
    """The progress of a training.

    Attributes:
        time: seconds since 1970, for people.
        phase: what the agent is doing.
        step, steps: environment steps done in this phase, and in all.
        steps_per_second: over the last few seconds.
        episode_return, uncertainty: mean over the last 20 finished episodes; None before the first.
        stages: median seconds that an environment step spends in each stage, over the last few hundred steps.
        process: when the process that wrote this was started; None in records of older versions.
        steady: seconds of the machine's monotonic clock, for measurements on that machine; None likewise.
    """

    time: float
    phase: Phase
    step: int
    steps: int
    episodes: int
    steps_per_second: float
    episode_return: float | None = None
    uncertainty: float | None = None
    stages: dict[Stage, float] = {}
    process: ProcessStart | None = None
    steady: float | None = None


class Episode(Struct, frozen=True, kw_only=True):
    """One finished flight; `uncertainty` is the weighted one (0 to 10) at its last step."""

    number: int
    seed: int
    policy: str
    total_reward: float
    length: int
    outcome: Outcome
    uncertainty: float
    success: bool


class Summary(Struct, frozen=True, kw_only=True):
    """A training at its end, or where it was stopped earlier (then it is not `complete` and can be resumed).

    Attributes:
        seconds: of training in all, over all processes that took part in it.
        stages: median seconds an environment step.
    """

    steps: int
    episodes: int
    updates: int
    seconds: float
    steps_per_second: float
    stages: dict[Stage, float]
    late_replies: int
    retries: int
    complete: bool = True


class Interval(Struct, frozen=True):
    """A mean and its 95% confidence interval."""

    mean: float
    low: float
    high: float


class PolicyScore(Struct, frozen=True, kw_only=True):
    """How one policy flew the evaluation's episodes."""

    policy: str
    episodes: int
    total_reward: Interval
    uncertainty: Interval
    success: Interval
    crash: Interval
    length: Interval


class Evaluation(Struct, frozen=True, kw_only=True):
    """The evaluation table: the trained policy first, then the baselines, all on the same scenes.

    Attributes:
        success_threshold: of the uncertainty, 0 to 10; of Hover-v1 of the upper body's radius, metres.
        in_metres: whether uncertainties are expected errors in metres.
        weights: sha256 of the run's weights when the evaluation began; None without weights, and in records of older
            versions.
        by: the incarnation of the process that flew it; None in records of older versions.
    """

    first_seed: int
    success_threshold: float
    scores: tuple[PolicyScore, ...]
    weights: str | None = None
    by: str | None = None
    in_metres: bool = False
