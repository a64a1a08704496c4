"""Renamed settings: a configuration with an old name is refused with the new one."""

from collections.abc import Iterator, Mapping
from typing import Any, cast

RENAMED: Mapping[str, str] = {
    "supervision.restarts": "max_restarts",
    "supervision.first_backoff": "initial_backoff",
    "supervision.longest_backoff": "max_backoff",
    "perception.rows": "input_height",
    "perception.columns": "input_width",
    "perception.region_rows": "region_height",
    "perception.region_columns": "region_width",
    "environment.keep_out": "keep_out_radius",
    "environment.lowest": "min_altitude",
    "environment.highest": "max_altitude",
    "learner.sac.hidden": "hidden_sizes",
    "learner.sac.memory": "buffer_size",
    "learner.sac.batch": "batch_size",
    "learner.sac.discount": "gamma",
    "learner.sac.polyak": "tau",
    "learner.sac.initial_entropy": "initial_ent_coef",
    "learner.ppo.hidden": "hidden_sizes",
    "learner.ppo.rollout": "n_steps",
    "learner.ppo.epochs": "n_epochs",
    "learner.ppo.discount": "gamma",
    "learner.ppo.clip": "clip_range",
    "learner.ppo.entropy": "ent_coef",
}
"""The new name of each setting, by its old name with the section."""


def renamed_in(table: Mapping[str, Any], section: str = "") -> Iterator[tuple[str, str]]:
    """The settings in a configuration's table that were renamed: the old name, and the new one."""
    for key, value in table.items():
        name = f"{section}{key}"
        if name in RENAMED:
            yield name, f"{section}{RENAMED[name]}"
        elif isinstance(value, Mapping):
            yield from renamed_in(cast(Mapping[str, Any], value), f"{name}.")
