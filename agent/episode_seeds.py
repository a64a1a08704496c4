"""Which seed an episode has: a function of the run's seed and of the episode's number, and of nothing else."""

import numpy as np

SEED_LIMIT = 2**31


def episode_seed(run_seed: int, number: int) -> int:
    """The seed of a run's episode `number`, counted from 0 in the order in which episodes begin."""
    return int(np.random.SeedSequence((run_seed, number)).generate_state(1)[0]) % SEED_LIMIT


def drawn_seed(rng: np.random.Generator) -> int:
    """A seed for where none was given."""
    return int(rng.integers(SEED_LIMIT))
