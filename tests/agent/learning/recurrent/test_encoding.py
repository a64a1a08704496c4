import numpy as np
import torch

from agent.learning.recurrent.encoding import INPUT_SIZE, encoded

CORNERS = torch.tensor([[-9.0, 9.0] + [0.0] * 18, [9.0, 1.0] + [1.0] * 18])


def test_positions_and_certainties_are_one_in_size_at_most_around_zero() -> None:
    inputs = encoded(CORNERS)
    assert inputs.shape == (2, INPUT_SIZE)
    assert inputs[:, :2].tolist() == [[-1.0, 1.0], [1.0, np.float32(1 / 9)]]
    assert np.unique(inputs[:, -18:]).tolist() == [-0.5, 0.5]


def test_column_and_row_are_one_hot() -> None:
    columns, rows = encoded(CORNERS)[:, 2:-18].unflatten(-1, (2, 19)).unbind(1)
    for one_hot, places in ((columns, [0, 18]), (rows, [18, 10])):
        assert one_hot.argmax(-1).tolist() == places
        assert one_hot.sum(-1).tolist() == [1.0, 1.0]


def test_leading_axes_stay_as_they_are() -> None:
    several = CORNERS.expand(3, 5, 2, 20)
    assert torch.equal(encoded(several)[2, 4], encoded(CORNERS))
