import numpy as np

from agent.environment.episode_seeds import SEED_LIMIT, drawn_seed, episode_seed


def test_a_seed_depends_on_run_and_number_alone() -> None:
    assert [episode_seed(3, number) for number in range(5)] == [episode_seed(3, number) for number in range(5)]


def test_runs_and_episodes_have_seeds_of_their_own() -> None:
    seeds = [episode_seed(run, number) for run in range(20) for number in range(50)]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < SEED_LIMIT for seed in seeds)


def test_the_seeds_of_a_run_stay_what_they_are() -> None:
    # They name the episodes of published runs.
    assert [episode_seed(0, number) for number in range(3)] == [821328062, 1817441348, 993632895]


def test_a_drawn_seed_is_in_range() -> None:
    assert 0 <= drawn_seed(np.random.default_rng(0)) < SEED_LIMIT
