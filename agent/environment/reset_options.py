"""The `options` of Gymnasium's `reset`: a mask of the drones that begin anew, and nothing else."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from protocol.arrays import AnyArray, BoolArray
from protocol.errors import InvalidInput

RESET_MASK = "reset_mask"
"""Gymnasium's name of the mask of environments that begin anew."""


def require_no_options(options: Mapping[str, Any] | None) -> None:
    """Refuse every option: an episode follows from its seed alone.

    Raises:
        InvalidInput: there is one; the message names it.
    """
    if options:
        raise InvalidInput(f"reset knows no option {_named(options)}: an episode follows from its seed")


def reset_mask(options: Mapping[str, Any] | None, num_envs: int) -> BoolArray:
    """(n,) which drones begin anew: all of them, or those that `options["reset_mask"]` names, as in Gymnasium.

    Raises:
        InvalidInput: there is another option, or the mask isn't one truth value a drone, at least one of them true.
    """
    others = {name: value for name, value in (options or {}).items() if name != RESET_MASK}
    if others:
        raise InvalidInput(f"reset knows no option {_named(others)}; of several drones it knows {RESET_MASK!r}")
    if not options:
        return np.ones(num_envs, bool)
    mask = _array_of(options[RESET_MASK])
    if mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise InvalidInput(
            f"options[{RESET_MASK!r}] is {num_envs} truth values, one a drone, not {mask.dtype} of the shape "
            f"{mask.shape}"
        )
    if not mask.any():
        raise InvalidInput(f"options[{RESET_MASK!r}] names no drone that begins anew")
    return mask.astype(np.bool_)


def _array_of(mask: object) -> AnyArray:
    try:
        return np.asarray(mask)
    except ValueError as error:  # Rows of different lengths.
        raise InvalidInput(f"options[{RESET_MASK!r}] is no array: {error}") from None


def _named(options: Mapping[str, Any]) -> str:
    return ", ".join(map(repr, options))
