import numpy as np
import pytest

from perception_worker.networks.tensorflow_graph import graph_message_type, read_graph
from protocol.errors import ArtifactDamaged
from tests.perception_worker import tiny_package
from tests.perception_worker.tiny_package import tiny_graph


@pytest.fixture(scope="module")
def nodes():
    return {node.name: node for node in read_graph(tiny_graph().SerializeToString())}


def test_a_convolution_has_inputs_strides_and_padding(nodes):
    node = nodes["first"]
    assert (node.operation, node.inputs) == ("Conv2D", ("image", "first/weights"))
    assert (node.strides, node.padding, node.window) == ((2, 2), "SAME", ())


def test_a_pooling_has_a_window(nodes):
    assert nodes["pool"].window == (2, 2)


def test_a_constant_holds_its_array(nodes):
    assert (nodes["first/weights"].value == tiny_package.FIRST).all()
    assert nodes["first/weights"].value.dtype == np.float32


def test_one_value_stands_for_an_array_filled_with_it(nodes):
    assert nodes["paf/offset"].value == pytest.approx(np.full(38, 0.1))
    assert nodes["axis"].value == 3


def test_bytes_that_are_no_graph_are_refused():
    with pytest.raises(ArtifactDamaged, match="no TensorFlow graph"):
        read_graph(b"\x0a\xff\xff\xff\xff\x0fnot a graph")


def test_a_constant_of_another_type_is_refused():
    graph = graph_message_type()()
    node = graph.node.add(name="half", op="Const")
    node.attr.add(key="value").value.tensor.dtype = 19
    with pytest.raises(ArtifactDamaged, match="type 19"):
        read_graph(graph.SerializeToString())
