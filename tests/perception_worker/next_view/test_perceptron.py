import numpy as np
import pytest
import torch
from torch.nn.functional import cross_entropy, mse_loss

from perception_worker.next_view.perceptron import Recipe, trained

RECIPE = Recipe(hidden=(16,), epochs=100, learning_rate=1e-2)


def exclusive_or(count: int = 200):
    inputs = np.random.default_rng(0).uniform(-1, 1, (count, 2)).astype(np.float32) * (1.0, 1000.0)
    return inputs.astype(np.float32), torch.from_numpy(((inputs[:, 0] > 0) != (inputs[:, 1] > 0)).astype(np.int64))


def test_a_perceptron_learns_what_no_linear_rule_tells_from_inputs_of_any_scale():
    inputs, classes = exclusive_or()
    outputs = trained(inputs, classes, 2, RECIPE, cross_entropy, 0).predict(inputs)
    assert outputs.shape == (200, 2)
    assert (outputs.argmax(axis=1) == classes.numpy()).mean() > 0.95


def test_a_seed_gives_the_same_perceptron_and_leaves_the_random_numbers_of_others_alone():
    inputs, classes = exclusive_or(40)
    recipe = Recipe(hidden=(4,), epochs=3, dropout=0.3, falling=True)
    torch.manual_seed(5)
    first = trained(inputs, classes, 2, recipe, cross_entropy, 7).predict(inputs)
    after = torch.rand(3)
    torch.manual_seed(5)
    assert torch.rand(3).equal(after)
    assert (trained(inputs, classes, 2, recipe, cross_entropy, 7).predict(inputs) == first).all()
    assert (trained(inputs, classes, 2, recipe, cross_entropy, 8).predict(inputs) != first).any()


def test_an_input_that_never_changes_does_not_spoil_the_outputs():
    inputs = np.ones((30, 3), np.float32)
    targets = np.full((30, 1), 4.0, np.float32)
    recipe = Recipe(hidden=(4,), epochs=300, learning_rate=5e-2)
    assert trained(inputs, targets, 1, recipe, mse_loss, 0).predict(inputs) == pytest.approx(
        np.full((30, 1), 4.0), abs=0.05
    )
