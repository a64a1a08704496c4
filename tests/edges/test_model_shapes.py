"""A network's file that takes or gives something else than a picture and maps as ours are.

Both engines are held to the same: refused when it is opened, with what the file has and what is needed, or used.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

from perception_worker.networks.backend import open_network
from protocol.config import PerceptionConfig
from protocol.errors import InvalidConfig

BOTH = pytest.mark.parametrize("backend", ["openvino", "onnxruntime"])
FLOAT, HALF, DOUBLE = TensorProto.FLOAT, TensorProto.FLOAT16, TensorProto.DOUBLE
NCHW, NHWC_TO_NCHW = (0, 1, 2, 3), (0, 3, 1, 2)

Shape = Sequence[int | str | None] | None
Write = Callable[..., Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes a pose network: a picture of any shape and kind in, turned into NCHW; 57 maps of a kind out."""

    def network(
        shape: Shape = ("n", 3, "h", "w"),
        *,
        kind: int = FLOAT,
        maps: int = FLOAT,
        turned: Sequence[int] = NCHW,
        colours: int = 3,
        beside: Sequence[ValueInfoProto] = (),
        extra: Sequence[tuple[NodeProto, ValueInfoProto]] = (),
    ) -> Path:
        weights = np.random.default_rng(2).normal(size=(57, colours, 8, 8)).astype(np.float32) * 1e-3
        nodes = [
            helper.make_node("Cast", ["image"], ["floats"], to=FLOAT),
            helper.make_node("Transpose", ["floats"], ["turned"], perm=turned),
            helper.make_node("Conv", ["turned", "weights"], ["found"], strides=[8, 8]),
            helper.make_node("Cast", ["found"], ["maps"], to=maps),
            *(node for node, _ in extra),
        ]
        outputs = [
            helper.make_tensor_value_info("maps", maps, ["n", 57, "r", "c"]),
            *(value for _, value in extra),
        ]
        inputs = [helper.make_tensor_value_info("image", kind, shape), *beside]
        graph = helper.make_graph(nodes, "network", inputs, outputs, [numpy_helper.from_array(weights, "weights")])
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
        file = tmp_path / "network.onnx"
        file.write_bytes(model.SerializeToString())
        return file

    return network


def opened(file: Path, backend: Any, size: tuple[int, int] | None = None) -> Any:
    rows, columns = size or (None, None)
    return open_network(PerceptionConfig(network=str(file), backend=backend, input_height=rows, input_width=columns))


@BOTH
@pytest.mark.parametrize("size", [None, (240, 320), (64, 96)])
@pytest.mark.parametrize("shape", [(1, 240, 320, 3), ("n", "h", "w", 3), (None, None, None, 3)])
def test_colours_that_come_last_are_refused_with_both_shapes(
    write: Write, shape: Shape, size: Any, backend: str
) -> None:
    file = write(shape, turned=NHWC_TO_NCHW)
    rows, columns = size or (240, 320)
    with pytest.raises(
        InvalidConfig, match=rf"network\.onnx takes image float32 \[.*, 3\].*\[1, 3, {rows}, {columns}\]"
    ):
        opened(file, backend, size)


@BOTH
@pytest.mark.parametrize(
    ("shape", "size"),
    [
        ((8, 3, "h", "w"), None),
        (("n", 1, "h", "w"), None),
        (("n", 4, "h", "w"), None),
        ((1, 3, 72, 88), (64, 96)),
        ((1, 3, 72, "w"), (64, 96)),
    ],
)
def test_another_batch_other_colours_and_another_size_are_refused(
    write: Write, shape: Sequence[Any], size: tuple[int, int] | None, backend: str
) -> None:
    with pytest.raises(InvalidConfig, match=r"perception\.network: .*takes image float32 \[.*\[1, 3, "):
        opened(write(shape, colours=shape[1]), backend, size)


@BOTH
def test_a_picture_of_another_number_of_sides_is_refused(write: Write, tmp_path: Path, backend: str) -> None:
    node = helper.make_node("Relu", ["image"], ["maps"])
    ports = [helper.make_tensor_value_info(name, FLOAT, [3, 240, 320]) for name in ("image", "maps")]
    model = helper.make_model(
        helper.make_graph([node], "flat", ports[:1], ports[1:]),
        opset_imports=[helper.make_opsetid("", 13)],
        ir_version=8,
    )
    file = tmp_path / "flat.onnx"
    file.write_bytes(model.SerializeToString())
    with pytest.raises(InvalidConfig, match=r"flat\.onnx takes image float32 \[3, 240, 320\].*\[1, 3, 240, 320\]"):
        opened(file, backend)


@BOTH
@pytest.mark.parametrize(
    ("shape", "size"),
    [
        (("n", 3, "h", "w"), (240, 320)),
        ((None, None, None, None), (240, 320)),
        (None, (240, 320)),
        ((1, 3, 72, 88), (72, 88)),
        ((1, 3, 72, "w"), (72, 320)),
        (("n", "c", 72, 88), (72, 88)),
    ],
)
def test_sides_that_may_be_any_are_ours_and_others_the_file_s(
    write: Write, shape: Shape, size: tuple[int, int], backend: str
) -> None:
    network = opened(write(shape), backend)
    output = network.infer(np.zeros((480, 640, 3), np.uint8))
    assert network.input_size == size
    assert output.heatmaps.shape == (19, size[0] // 8, size[1] // 8)


@BOTH
@pytest.mark.parametrize("kind", [FLOAT, HALF, DOUBLE])
@pytest.mark.parametrize("maps", [FLOAT, HALF, DOUBLE])
def test_pictures_and_maps_of_other_floats_are_ours_in_float32(
    write: Write, kind: int, maps: int, backend: str
) -> None:
    picture = np.random.default_rng(3).integers(0, 256, (64, 96, 3), np.uint8)
    expected = opened(write(), backend, (64, 96)).infer(picture)
    output = opened(write(kind=kind, maps=maps), backend, (64, 96)).infer(picture)
    assert (output.heatmaps.dtype, output.pafs.dtype) == (np.float32, np.float32)
    # float16 has 11 binary digits.
    assert output.heatmaps == pytest.approx(expected.heatmaps, rel=2e-3, abs=1e-3)


@BOTH
@pytest.mark.parametrize("kind", [TensorProto.UINT8, TensorProto.INT64, TensorProto.BFLOAT16])
def test_pictures_and_maps_of_what_numpy_has_no_floats_for_are_refused(write: Write, kind: int, backend: str) -> None:
    with pytest.raises(InvalidConfig, match=r"perception\.network: .*network\.onnx"):
        opened(write(kind=kind), backend)
    with pytest.raises(InvalidConfig, match=r"perception\.network: .*network\.onnx"):
        opened(write(maps=kind), backend)


@BOTH
def test_a_second_input_is_refused_by_name(write: Write, backend: str) -> None:
    added = helper.make_node("Add", ["maps", "prompt"], ["prompted"])
    value = helper.make_tensor_value_info("prompted", FLOAT, ["n", 57, "r", "c"])
    prompt = helper.make_tensor_value_info("prompt", FLOAT, [1])
    with pytest.raises(InvalidConfig, match=r"takes image float32 .*, prompt float32 \[1\], and is to be shown one"):
        opened(write(beside=[prompt], extra=[(added, value)]), backend)


@BOTH
def test_outputs_that_are_no_maps_are_left_out(write: Write, backend: str) -> None:
    counted = helper.make_node("ReduceSum", ["maps"], ["sum"], keepdims=0)
    shaped = helper.make_node("Shape", ["maps"], ["shape"])
    file = write(
        extra=[
            (counted, helper.make_tensor_value_info("sum", FLOAT, [])),
            (shaped, helper.make_tensor_value_info("shape", TensorProto.INT64, [4])),
        ]
    )
    assert opened(file, backend).infer(np.zeros((240, 320, 3), np.uint8)).heatmaps.shape == (19, 30, 40)


@BOTH
def test_a_network_that_fails_on_its_first_picture_is_refused_in_one_sentence(write: Write, backend: str) -> None:
    """Nothing of its signature tells it: its maps are added to a table of another size."""
    table = helper.make_node(
        "Constant", [], ["table"], value=numpy_helper.from_array(np.ones((1, 57, 7, 7), np.float32))
    )
    added = helper.make_node("Add", ["maps", "table"], ["added"])
    value = helper.make_tensor_value_info("added", FLOAT, ["n", 57, "p", "q"])
    table_value = helper.make_tensor_value_info("table", FLOAT, [1, 57, 7, 7])
    with pytest.raises(InvalidConfig, match=r"can't use .*network\.onnx on images of 240×320: .+") as refused:
        opened(write(extra=[(table, table_value), (added, value)]), backend)
    assert "\n" not in str(refused.value)


@BOTH
def test_maps_whose_columns_come_first_are_refused(write: Write, backend: str) -> None:
    turned = helper.make_node("Transpose", ["maps"], ["lying"], perm=[0, 1, 3, 2])
    file = write(extra=[(turned, helper.make_tensor_value_info("lying", FLOAT, ["n", 57, "c", "r"]))])
    with pytest.raises(InvalidConfig, match=r"lying \[n, 57, 40, 30\] .*images of 240×320"):
        opened(file, backend)
