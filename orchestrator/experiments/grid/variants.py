"""The trainings of the exploration experiment: what each changes, with which seeds (thesis, sections 4.5 and 4.6)."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from msgspec import Struct
from msgspec.structs import replace

from protocol.config import RunConfig
from protocol.errors import InvalidInput
from protocol.grid.threshold import THESIS_THRESHOLD
from protocol.grid_config import GridConfig

Change = Callable[[RunConfig], RunConfig]


class Variant(Struct, frozen=True):
    """A training with one thing changed.

    Attributes:
        words: what it is, for tables.
        change: makes its configuration of the experiment's.
    """

    words: str
    change: Change


class GridTraining(Struct, frozen=True):
    """One training: a variant with a seed, in the run directory `path`."""

    variant: str
    seed: int
    path: Path
    config: RunConfig


def _grid(**changes: object) -> Change:
    def changed(config: RunConfig) -> RunConfig:
        grid: GridConfig = replace(config.grid, **changes)
        return replace(config, grid=grid)

    return changed


def _without_memory(config: RunConfig) -> RunConfig:
    learner = replace(config.learner, recurrent_ppo=replace(config.learner.recurrent_ppo, memory=False))
    return replace(config, learner=learner)


VARIANTS: Mapping[str, Variant] = {
    "quality": Variant("reward by quality", _grid(reward="quality")),
    "path_length": Variant("binary reward, path length penalty", _grid(reward="path_length")),
    "binary": Variant("binary reward", _grid(reward="binary")),
    "position": Variant("reward by quality, none in the observation", _grid(observation="position")),
    "no-memory": Variant("reward by quality, no memory", _without_memory),
    "at-1.1": Variant("reward by quality, the thesis's threshold", _grid(success_threshold=THESIS_THRESHOLD)),
    "vantage": Variant("reward by quality, table in metres", _grid(table="vantage")),
}
"""By name, each of the experiment's own configuration."""


def trainings(out: Path, config: RunConfig, variants: Sequence[str], seeds: int) -> tuple[GridTraining, ...]:
    """The trainings of some variants with the seeds from that of `config` on; seed by seed, so that all variants grow.

    Raises:
        InvalidInput: a variant is unknown, or the configuration is of no grid.
    """
    if not config.is_grid:
        raise InvalidInput(f"a grid experiment trains on vantage/Grid-v0, not on {config.env_id}")
    if unknown := [name for name in variants if name not in VARIANTS]:
        raise InvalidInput(f"there is no variant {', '.join(unknown)}; there are {', '.join(VARIANTS)}")
    return tuple(
        GridTraining(
            variant=name,
            seed=seed,
            path=out / f"{name}-seed-{seed}",
            config=replace(VARIANTS[name].change(config), seed=seed),
        )
        for seed in range(config.seed, config.seed + seeds)
        for name in variants
    )
