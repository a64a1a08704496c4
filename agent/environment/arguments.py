"""Checks of the arguments that Gymnasium's `make` and `make_vec` pass to an environment."""

import operator
from typing import get_args

from gymnasium.vector import AutoresetMode

from protocol.errors import InvalidInput
from protocol.scene import Split


def require_no_rendering(
    render_mode: str | None, words: str = "Hover-v0 renders nothing; 'orchestrator view' draws its views"
) -> None:
    """Refuse every way of rendering.

    Args:
        words: what is there instead.

    Raises:
        InvalidInput: one is named.
    """
    if render_mode is not None:
        raise InvalidInput(f"render_mode {render_mode!r}: {words}")


def require_split(split: str) -> None:
    """Refuse an unknown split of people.

    Raises:
        InvalidInput: no split has that name.
    """
    if split not in get_args(Split):
        raise InvalidInput(f"split {split!r}: people are split into {' and '.join(get_args(Split))}")


def require_drones(num_envs: int) -> int:
    """The number of drones that fly at once.

    Raises:
        InvalidInput: it is not a whole number of 1 or more.
    """
    try:
        drones = operator.index(num_envs)
    except TypeError:
        raise InvalidInput(f"num_envs is a whole number, not {num_envs!r}") from None
    if drones < 1:
        raise InvalidInput(f"num_envs is 1 or more, not {drones}")
    return drones


def require_autoreset(mode: AutoresetMode | str) -> AutoresetMode:
    """Gymnasium's autoreset mode, which may be given by its name there, such as "Disabled".

    Raises:
        InvalidInput: no mode has that name, or it is the mode that is not offered.
    """
    try:
        known = AutoresetMode(mode)
    except ValueError:
        raise InvalidInput(f"autoreset_mode {mode!r}: Gymnasium knows {[one.value for one in AutoresetMode]}") from None
    if known is AutoresetMode.NEXT_STEP:
        raise InvalidInput(
            f"autoreset_mode {known.value!r}: a flight is followed by the next in the same step, or not at all"
        )
    return known
