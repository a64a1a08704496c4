"""What Gymnasium's `make` and `make_vec` may hand to an environment, held against what there is."""

import operator
from typing import get_args

from gymnasium.vector import AutoresetMode

from protocol.errors import InvalidInput
from protocol.scene import Split


def require_no_rendering(render_mode: str | None) -> None:
    """Refuse every way of rendering; `orchestrator view` draws what a drone sees.

    Raises:
        InvalidInput: one is named.
    """
    if render_mode is not None:
        raise InvalidInput(
            f"render_mode {render_mode!r}: Hover-v0 renders nothing; 'orchestrator view' draws its views"
        )


def require_split(split: str) -> None:
    """Refuse a split of people that there is not.

    Raises:
        InvalidInput: there is none of that name.
    """
    if split not in get_args(Split):
        raise InvalidInput(f"split {split!r}: people are split into {' and '.join(get_args(Split))}")


def require_drones(num_envs: int) -> int:
    """How many drones fly at once.

    Raises:
        InvalidInput: it is no whole number from 1 on.
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
        InvalidInput: there is none of that name, or it is the one that is not offered.
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
