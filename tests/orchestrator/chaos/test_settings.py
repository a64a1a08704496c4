from msgspec.structs import replace

from orchestrator.chaos.settings import rehearsal_config
from protocol.config import RunConfig, TimeoutsConfig, TrainingConfig


def test_only_what_no_result_depends_on_is_set_otherwise():
    config = RunConfig(seed=3, timeouts=TimeoutsConfig(grace=33.0))
    found = rehearsal_config(config, faults=20, steps=11_000)
    same = replace(
        found,
        timeouts=config.timeouts,
        supervision=config.supervision,
        training=replace(found.training, checkpoint_every=config.training.checkpoint_every),
    )
    assert same == config
    assert found.timeouts.grace == 33.0


def test_there_are_two_checkpoints_in_the_stretch_of_each_fault():
    assert rehearsal_config(RunConfig(), faults=20, steps=4000).training.checkpoint_every == 87


def test_checkpoints_that_are_more_frequent_already_stay_so():
    config = RunConfig(training=TrainingConfig(checkpoint_every=30))
    assert rehearsal_config(config, faults=20, steps=4000).training.checkpoint_every == 30


def test_a_reply_past_its_deadline_comes_before_its_worker_is_taken_for_hung():
    timeouts = rehearsal_config(RunConfig(), faults=20, steps=4000).timeouts
    assert timeouts.call + 2.0 < timeouts.progress
