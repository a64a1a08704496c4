"""The configuration of the learners, with the names that SB3 and CleanRL have for their settings."""

from typing import Literal

from protocol.config_bounds import Count, Fraction, LstmLayers, Negative, NotNegative, Positive, Units
from protocol.config_section import Section
from protocol.errors import InvalidConfig

BYTES_OF_TRANSITION = 800
"""Memory of one transition in SAC's replay buffer: the features before and after it, its action and its reward."""


class SacConfig(Section, frozen=True):
    """Soft actor-critic (thesis, section 4.3.2).

    Attributes:
        hidden_sizes: of the hidden layers.
        buffer_size: number of transitions in the replay buffer.
        batch_size: number of transitions in an update.
        updates_per_step: number of gradient updates for each transition.
        gamma: discount factor.
        tau: share of the new weights in each update of the target networks.
        initial_ent_coef: the entropy coefficient's first value; it is learned.
        reward_floor: lower rewards are learned as this, so that crashes do not hide the differences between views.
        reward_scale: factor on the rewards that the critics learn, relative to the entropy bonus.
    """

    hidden_sizes: tuple[Units, ...] = (128, 128)
    buffer_size: Count = 100_000
    batch_size: Count = 256
    updates_per_step: Positive = 1.0
    learning_rate: Positive = 3e-4
    gamma: Fraction = 0.98
    tau: Fraction = 0.005
    initial_ent_coef: Positive = 0.2
    reward_floor: Negative = -30.0
    reward_scale: Positive = 10.0

    def require_batch(self, num_envs: int) -> None:
        """Raise `InvalidConfig` unless the replay buffer holds a batch, and a step of every drone."""
        if self.buffer_size < max(self.batch_size, num_envs):
            raise InvalidConfig(
                f"learner.sac.buffer_size: {self.buffer_size} transitions hold no batch of {self.batch_size} "
                f"from {num_envs} drones"
            )

    def require_memory(self, machine_bytes: int) -> None:
        """Raise `InvalidConfig` unless the replay buffer fits into a machine's memory."""
        needed = self.buffer_size * BYTES_OF_TRANSITION
        if needed > machine_bytes:
            raise InvalidConfig(
                f"learner.sac.buffer_size: {self.buffer_size} transitions take {needed / 2**30:.1f} GiB of memory, and "
                f"this machine has {machine_bytes / 2**30:.1f}"
            )


class PpoConfig(Section, frozen=True):
    """Proximal policy optimisation on the same environment.

    Attributes:
        n_steps: number of steps of every drone between two updates.
        n_epochs: number of passes over these steps, each in `minibatches`.
        clip_range, ent_coef, gae_lambda: as in the algorithm's paper.
        hidden_sizes, gamma, reward_floor, reward_scale: as for SAC.
    """

    hidden_sizes: tuple[Units, ...] = (256, 256)
    n_steps: Count = 128
    n_epochs: Count = 8
    minibatches: Count = 4
    learning_rate: Positive = 3e-4
    gamma: Fraction = 0.98
    gae_lambda: Fraction = 0.95
    clip_range: Positive = 0.2
    ent_coef: NotNegative = 0.0
    reward_floor: Negative = -30.0
    reward_scale: Positive = 1.0

    def require_minibatches(self, num_envs: int) -> None:
        """Raise `InvalidConfig` unless a rollout can be cut into its minibatches."""
        if self.n_steps * num_envs < self.minibatches:
            raise InvalidConfig(
                f"learner.ppo.n_steps: {self.n_steps} steps of {num_envs} drones make no {self.minibatches} minibatches"
            )


class RecurrentPpoConfig(Section, frozen=True):
    """Proximal policy optimisation with memory (thesis, section 4.3.6), on `vantage/Grid-v0`.

    Attributes:
        n_lstm_layers, lstm_hidden_size: of the LSTM, one for the policy and one for the value.
        hidden_size: of the tanh layer after it.
        memory: whether the LSTM remembers earlier steps; without, each step is one of its own.
        n_steps: number of steps of every drone between two updates; gradients go back through all of them.
        n_epochs: number of passes over these steps, each in `minibatches` of whole drones.
        learning_rate, final_learning_rate, learning_rate_steps: Adam's step size falls evenly from the first to the
            second value over this many environment steps.
        ent_coef, final_ent_coef, ent_coef_steps: the entropy bonus, in the same way.
        reward_scale: factor on the rewards that are learned.
        gamma, gae_lambda, clip_range, vf_coef, max_grad_norm: as in the algorithm's paper and in SB3.
    """

    n_lstm_layers: LstmLayers = 2
    lstm_hidden_size: Units = 256
    hidden_size: Units = 128
    memory: bool = True
    n_steps: Count = 32
    n_epochs: Count = 4
    minibatches: Count = 4
    learning_rate: Positive = 3e-4
    final_learning_rate: NotNegative = 0.0
    learning_rate_steps: Count = 2_000_000
    gamma: Fraction = 0.99
    gae_lambda: Fraction = 0.95
    clip_range: Positive = 0.2
    vf_coef: NotNegative = 0.5
    max_grad_norm: Positive = 0.5
    ent_coef: NotNegative = 0.3
    final_ent_coef: NotNegative = 0.0
    ent_coef_steps: Count = 800_000
    reward_scale: Positive = 0.1

    def require_minibatches(self, num_envs: int) -> None:
        """Raise `InvalidConfig` unless the drones can be cut into the minibatches."""
        if num_envs % self.minibatches:
            raise InvalidConfig(
                f"learner.recurrent_ppo.minibatches: {num_envs} drones can't be cut into {self.minibatches} equal parts"
            )


class LearnerConfig(Section, frozen=True):
    """The learner, and the settings of each; to change `algorithm` is enough to change the learner."""

    algorithm: Literal["sac", "ppo", "recurrent_ppo"] = "sac"
    sac: SacConfig = SacConfig()
    ppo: PpoConfig = PpoConfig()
    recurrent_ppo: RecurrentPpoConfig = RecurrentPpoConfig()
