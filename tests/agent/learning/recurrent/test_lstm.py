"""Our layer against torch's own and autograd."""

import pytest
import torch
from torch import Tensor, nn

from agent.learning.recurrent.lstm import (
    LstmSequence,
    LstmWeights,
    gate_gradients,
    input_gradient,
    run_layer,
    weight_gradients,
)

STEPS, DRONES = 9, 40


class Layer:
    """A layer of torch's, a sequence with episodes that start in it, and the gradient of a loss by its outputs."""

    def __init__(self, inputs: int, size: int, dtype: torch.dtype) -> None:
        torch.manual_seed(0)
        self.lstm = nn.LSTM(inputs, size, dtype=dtype)
        self.inputs = torch.randn(STEPS, DRONES, inputs, dtype=dtype, requires_grad=True)
        self.keep = (torch.rand(STEPS, DRONES, 1) > 0.3).to(dtype)
        self.state = torch.randn(2, DRONES, size, dtype=dtype)
        self.gradient = torch.randn(STEPS, DRONES, size, dtype=dtype)

    @property
    def weights(self) -> LstmWeights:
        lstm = self.lstm
        bias = lstm.bias_ih_l0 + lstm.bias_hh_l0
        return LstmWeights(lstm.weight_ih_l0.detach(), lstm.weight_hh_l0.detach(), bias.detach())

    def by_torch(self) -> tuple[Tensor, Tensor]:
        """Outputs and cells."""
        hidden, cells = self.state[:, None]
        outputs, all_cells = [], []
        for inputs, keep in zip(self.inputs, self.keep, strict=True):
            output, (hidden, cells) = self.lstm(inputs[None], (hidden * keep, cells * keep))
            outputs.append(output)
            all_cells.append(cells)
        return torch.cat(outputs), torch.cat(all_cells)

    @torch.no_grad()
    def by_us(self) -> tuple[LstmSequence, LstmWeights, Tensor]:
        """The sequence, and the gradients of weights and inputs."""
        sequence = run_layer(self.weights, self.inputs, self.keep, self.state)
        of_gates = gate_gradients(self.weights, sequence, self.gradient)
        return sequence, weight_gradients(sequence, of_gates), input_gradient(self.weights, of_gates)


# In single precision, layers as wide as the second go to oneDNN.
SIZES = [(5, 8, torch.float64, 1e-12), (48, 64, torch.float32, 1e-5), (20, 64, torch.float32, 1e-5)]


@pytest.mark.parametrize(("inputs", "size", "dtype", "tolerance"), SIZES)
def test_outputs_and_cells_are_those_of_torchs_own(inputs, size, dtype, tolerance) -> None:
    layer = Layer(inputs, size, dtype)
    outputs, cells = layer.by_torch()
    sequence, _, _ = layer.by_us()
    assert torch.allclose(sequence.outputs, outputs, atol=tolerance)
    assert torch.allclose(sequence.cells, cells, atol=tolerance)


@pytest.mark.parametrize(("inputs", "size", "dtype", "tolerance"), SIZES)
def test_gradients_are_those_of_autograd(inputs, size, dtype, tolerance) -> None:
    layer = Layer(inputs, size, dtype)
    layer.by_torch()[0].backward(layer.gradient)
    _, gradients, of_inputs = layer.by_us()
    lstm = layer.lstm
    for ours, theirs in [
        (gradients.of_inputs, lstm.weight_ih_l0.grad),
        (gradients.of_hidden, lstm.weight_hh_l0.grad),
        (gradients.bias, lstm.bias_hh_l0.grad),
        (of_inputs, layer.inputs.grad),
    ]:
        assert theirs is not None
        assert ((ours - theirs).abs().max() / theirs.abs().max()).item() < tolerance


def test_the_first_state_is_forgotten_where_an_episode_starts_with_the_first_step() -> None:
    layer = Layer(5, 8, torch.float64)
    layer.keep[0, :7] = 0.0
    before = layer.by_us()[0].outputs[0]
    layer.state += 1.0
    after = layer.by_us()[0].outputs[0]
    assert torch.equal(before[:7], after[:7])
    kept = layer.keep[0, 7:, 0] == 1.0
    assert (before[7:][kept] != after[7:][kept]).any(1).all()
