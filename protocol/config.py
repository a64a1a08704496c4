"""The configuration of a run: one TOML file, with a typed section for each room.

The orchestrator reads it once, writes it resolved into the run directory, and starts every process with that copy
(`protocol.config_file`).
"""

from collections.abc import Mapping
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, field
from msgspec.structs import replace

from protocol.artifact import bodies_path
from protocol.config_bounds import (
    Count,
    CountOrNone,
    Duration,
    EvaluationSeed,
    Fraction,
    ImageSide,
    InHand,
    NotNegative,
    Processes,
    Threads,
    ThreadsOrNone,
)
from protocol.config_section import Section
from protocol.environment_config import EnvironmentConfig, HoverConfig
from protocol.errors import InvalidConfig
from protocol.frame import Encoding
from protocol.grid_config import GridConfig
from protocol.learner_config import LearnerConfig
from protocol.named_files import NamedFile
from protocol.pose_estimate import Lifting

FrameEncoding: TypeAlias = Literal["auto", Encoding]
EnvironmentId: TypeAlias = Literal["vantage/Hover-v0", "vantage/Hover-v1", "vantage/Grid-v0"]
Profile: TypeAlias = Literal["thesis", "vantage"]
Baseline: TypeAlias = Literal["stay", "random", "circle", "front", "greedy", "optimum"]
Layout: TypeAlias = Literal["auto", "openpose", "trt_pose"]
Pixels: TypeAlias = Literal["bgr", "bgr_centred", "rgb_unit", "rgb_signed", "rgb_imagenet"]
Checksum: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]

BASELINES: Mapping[EnvironmentId, tuple[Baseline, ...]] = {
    "vantage/Hover-v0": ("stay", "random", "circle", "front"),
    "vantage/Hover-v1": ("stay", "random", "circle", "front"),
    "vantage/Grid-v0": ("random", "circle", "greedy", "optimum"),
}
"""The baselines of each environment."""

NETWORK_FILE = NamedFile("the network", words=r"\w+")
"""A single word is the name of a network; a path has an extension or a folder."""


class TimeoutsConfig(Section, frozen=True):
    """Seconds; none of them changes the result of a training.

    Attributes:
        call: bounds one request from send to reply, retries included.
        startup: from the first try to reach a worker until it is ready (imports, shaders, models).
        heartbeat: between two pings to a worker that holds requests.
        liveness: a worker that answers no ping for this long hangs.
        progress: a worker that answers pings but none of its requests for this long hangs as well.
        grace: how long workers and agent continue without their orchestrator before they end by themselves.
    """

    call: Duration = 30.0
    startup: Duration = 120.0
    heartbeat: Duration = 0.5
    liveness: Duration = 5.0
    progress: Duration = 20.0
    grace: Duration = 60.0


class SupervisionConfig(Section, frozen=True):
    """When the supervisor restarts local processes.

    Attributes:
        max_restarts: of one process within `window` seconds; after one more failure the run stops.
        window: seconds.
        initial_backoff: seconds before the second restart in a row (the first is at once); it doubles with each
            further one, up to `max_backoff` seconds.
        recycle_bytes: resident memory above which a worker is replaced, between requests; 0 for never.
        recycle_requests: number of answered requests after which a worker is replaced; 0 for never.
    """

    max_restarts: Count = 5
    window: Duration = 60.0
    initial_backoff: Duration = 0.5
    max_backoff: Duration = 10.0
    recycle_bytes: CountOrNone = 4 * 1024**3
    recycle_requests: CountOrNone = 0


class RenderConfig(Section, frozen=True):
    """Render workers.

    Attributes:
        workers: number of processes.
        threads: of the software rasteriser (llvmpipe); 0 for the calling thread only.
        prefetch: number of requests in hand at once, so that one scene is prepared while another is drawn.
        bodies: the file of baked bodies; left out, the one in the user's cache.
    """

    workers: Processes = 1
    threads: ThreadsOrNone = 0
    prefetch: InHand = 2
    bodies: Annotated[str, NamedFile("the file of bodies", otherwise=bodies_path)] | None = None


class PerceptionConfig(Section, frozen=True):
    """Perception workers. Paths are relative to the configuration's own file.

    Attributes:
        workers: number of processes.
        network: a network's name (`orchestrator models list`), or an ONNX file of heatmaps and part-affinity fields,
            whose path must have a folder or an extension; left out, `openpose_mobilenet_thin`, and with `track` five
            of its six stages.
        layout: the order of joints and fields in a file; `auto` detects it by the number of channels.
        pixels: the input values of a file: 0 to 255 (`bgr`), less 128 and divided by 256 (`bgr_centred`), 0 to 1
            (`rgb_unit`), -1 to 1 (`rgb_signed`), or standardised by ImageNet's means and deviations
            (`rgb_imagenet`); `auto` is `bgr` for OpenPose's layout, and `rgb_imagenet` for trt_pose's.
        backend: the inference engine; `auto` is OpenVINO without a GPU, ONNX Runtime with one.
        precision: of OpenVINO, which would otherwise choose it by the CPU, so that heatmaps would differ.
        threads: of one inference; OpenVINO runs as many inferences at once as the cores allow, at most `prefetch`.
        input_height, input_width: the network's input size for whole frames, multiples of 8. Left out, it is that of
            the file or network, or 240×320 if that has none; with `track`, frames in which no person was found are
            then tried at 320×424 as well. A network of a fixed size takes no other.
        look: the part of a frame that the network gets: all of it (`whole`), or the part where the request's filter
            expects the person (`track`); `auto` is the profile's choice.
        region_height, region_width: the network's input size for that part. Left out, it is that of the file or
            network, or 176×120 if that has none.
        lifting: how a keypoint's depth is taken from the depths around it; or `learned`: a lifter that was fitted to
            people with known joints places all joints. `auto` is the profile's choice.
        lifter: the learned lifter's file; `auto` is the one that ships for this network, and without one, lifting is
            `nearest`. A file is allowed with `learned` only.
        calibration: the file that predicts expected errors and radii, or `none`; `auto` is the one that ships for this
            network and way of lifting, if there is one. A learned lifter predicts its own.
        peak_threshold: the height that a peak in a heatmap must exceed; left out, it is the network's own.
        mask: whether other people's peaks lower the mass of a joint's peak: always (`none`), or not if they stand
            apart from it (`skeleton`); `auto` is the profile's choice.
        prefetch: number of requests in hand at once, so that one is rendered while another is inferred.
        frames: how render workers send frames: not packed (`none`), packed without loss, or as JPEG, which changes
            what the network sees a little; `auto` is `lossless` from other machines and `none` within this one.
    """

    workers: Processes = 1
    network: Annotated[str, NETWORK_FILE] | None = None
    layout: Layout = "auto"
    pixels: Literal["auto", Pixels] = "auto"
    backend: Literal["auto", "openvino", "onnxruntime"] = "auto"
    precision: Literal["f32", "bf16"] = "f32"
    threads: Threads = 1
    input_height: ImageSide | None = None
    input_width: ImageSide | None = None
    look: Literal["auto", "whole", "track"] = "auto"
    region_height: ImageSide | None = None
    region_width: ImageSide | None = None
    peak_threshold: Fraction | None = None
    lifting: Literal["auto", "learned", Lifting] = "auto"
    lifter: Annotated[str, NamedFile("the lifter", words="auto")] = "auto"
    calibration: Annotated[str, NamedFile("the calibration", words="auto|none")] = "auto"
    mask: Literal["auto", "none", "skeleton"] = "auto"
    prefetch: InHand = 4
    frames: FrameEncoding = "auto"

    def __post_init__(self) -> None:
        if self.backend == "onnxruntime" and self.precision != "f32":
            raise InvalidConfig(f"perception.precision: {self.precision} is OpenVINO's; ONNX Runtime computes in f32")


class TrainingConfig(Section, frozen=True):
    """How long to train, in environment steps of all drones together.

    Attributes:
        steps: flown by the learner.
        prefill: steps of scripted flights before that, to fill the replay buffer; a learner without one flies none.
        prefill_noise: the largest standard deviation of scripted velocities, m/s; each flight draws its own.
        log_every: steps between two points of the curves.
        checkpoint_every: steps between two checkpoints; after a crash, the steps since the last one are flown again.
        keep_checkpoints: number of the latest checkpoints to keep, besides the best.
    """

    steps: Count = 10_000
    prefill: CountOrNone = 1_000
    prefill_noise: NotNegative = 1.5
    log_every: Count = 100
    checkpoint_every: Count = 500
    keep_checkpoints: Count = 3


class EvaluationConfig(Section, frozen=True):
    """Flights on test identities; every policy flies the same scenes.

    Attributes:
        episodes, first_seed: flights of each policy, and the seed of the first; on the grid, every start of every test
            environment is walked instead.
        baselines: the policies that the trained one is compared with; left out, all of the environment's.
    """

    episodes: Count = 20
    first_seed: EvaluationSeed = 1_000_000
    baselines: tuple[Baseline, ...] | None = None


class RunConfig(Section, frozen=True):
    """Everything that a run depends on, except the machines that it runs on.

    Attributes:
        env_id: the environment. Hover flies with workers; Grid walks on a table of views that were taken before.
        profile: whose choices count where a field is left at `auto`: the thesis's, or ours where they measured better.
        artifacts: the sha256 of files, by the name of the setting that takes the path. A run's own copy has those of
            all its files, and a run does not resume with another file.
    """

    seed: Annotated[int, Meta(ge=0, lt=2**31)] = 0
    env_id: EnvironmentId = "vantage/Hover-v0"
    profile: Profile = "vantage"
    timeouts: TimeoutsConfig = TimeoutsConfig()
    supervision: SupervisionConfig = SupervisionConfig()
    render: RenderConfig = RenderConfig()
    perception: PerceptionConfig = PerceptionConfig()
    environment: EnvironmentConfig = EnvironmentConfig()
    hover: HoverConfig = HoverConfig()
    grid: GridConfig = GridConfig()
    learner: LearnerConfig = LearnerConfig()
    training: TrainingConfig = field(default_factory=TrainingConfig)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    artifacts: dict[str, Checksum] = {}

    def __post_init__(self) -> None:
        learner, needed = self.learner, "recurrent_ppo" if self.is_grid else "sac or ppo"
        if (learner.algorithm == "recurrent_ppo") is not self.is_grid:
            raise InvalidConfig(f"learner.algorithm: {self.env_id} is learned by {needed}, not by {learner.algorithm}")
        for name in self.baselines:
            if name not in BASELINES[self.env_id]:
                raise InvalidConfig(
                    f"evaluation.baselines: {self.env_id} has {', '.join(BASELINES[self.env_id])}, and no {name}"
                )
        if learner.algorithm == "sac":
            learner.sac.require_batch(self.flown.num_envs)
        elif learner.algorithm == "ppo":
            learner.ppo.require_minibatches(self.flown.num_envs)
        else:
            learner.recurrent_ppo.require_minibatches(self.grid.num_envs)

    @property
    def baselines(self) -> tuple[Baseline, ...]:
        """The baselines of the evaluation."""
        return BASELINES[self.env_id] if self.evaluation.baselines is None else self.evaluation.baselines

    @property
    def num_envs(self) -> int:
        """The number of drones."""
        return self.grid.num_envs if self.is_grid else self.flown.num_envs

    @property
    def flown(self) -> EnvironmentConfig:
        """The section of the environment that flies: `environment` for Hover-v0, `hover` for Hover-v1."""
        return self.hover if self.env_id == "vantage/Hover-v1" else self.environment

    @property
    def policies(self) -> tuple[str, ...]:
        """The policies of the evaluation: the trained one, then the baselines."""
        return (self.learner.algorithm, *self.baselines)

    @property
    def is_grid(self) -> bool:
        """Whether the environment is a grid of views that were taken before, which needs no workers."""
        return self.env_id == "vantage/Grid-v0"

    def require_memory(self, machine_bytes: int) -> None:
        """Raise `InvalidConfig` unless the learner's replay buffer fits into a machine's memory."""
        if self.learner.algorithm == "sac":
            self.learner.sac.require_memory(machine_bytes)


_PERCEPTION: dict[Profile, dict[str, str]] = {
    "thesis": {"look": "whole", "lifting": "mean", "mask": "none"},
    "vantage": {"look": "track", "lifting": "learned", "mask": "skeleton"},
}


def settled(config: PerceptionConfig, profile: Profile) -> PerceptionConfig:
    """The section with the profile's choices in place of `auto`."""
    return replace(
        config, **{name: own for name, own in _PERCEPTION[profile].items() if getattr(config, name) == "auto"}
    )
