"""ONNX networks that nobody wants to run."""

from __future__ import annotations

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

IMAGE = [1, 3, 256, 256]
PLANE = [1, 1, 256, 256]


def _saved(nodes: list, constants: dict | None = None, depth: list | None = None) -> bytes:
    graph = helper.make_graph(
        nodes,
        "network",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, IMAGE)],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, depth or PLANE)],
        [numpy_helper.from_array(value, name) for name, value in (constants or {}).items()],
    )
    opset = [helper.make_opsetid("", 17)]
    return helper.make_model(graph, opset_imports=opset, ir_version=9).SerializeToString()


def _mean() -> onnx.NodeProto:
    return helper.make_node("ReduceMean", ["x"], ["m"], axes=[1], keepdims=1)


def _side(size_bytes: int) -> np.ndarray:
    side = int((size_bytes / 4) ** 0.5)
    return np.array([side, side], np.int64)


def that_wants(size_bytes: int) -> bytes:
    """A tensor of that size when it runs."""
    one = helper.make_tensor("one", TensorProto.FLOAT, [1], [1.0])
    nodes = [
        _mean(),
        helper.make_node("ConstantOfShape", ["s"], ["big"], value=one),
        helper.make_node("ReduceMean", ["big"], ["b"], keepdims=0),
        helper.make_node("Add", ["m", "b"], ["y"]),
    ]
    return _saved(nodes, {"s": _side(size_bytes)})


def that_expands(size_bytes: int) -> bytes:
    """Constants that are multiplied when it is opened."""
    nodes = [
        _mean(),
        helper.make_node("Expand", ["c", "s"], ["big"]),
        helper.make_node("ReduceMean", ["big"], ["b"], keepdims=0),
        helper.make_node("Add", ["m", "b"], ["y"]),
    ]
    return _saved(nodes, {"s": _side(size_bytes), "c": np.ones((1, 1), np.float32)})


def _loop(collects: bool) -> bytes:
    values = [("i", TensorProto.INT64, []), ("go", TensorProto.BOOL, []), ("v", TensorProto.FLOAT, PLANE)]
    nodes = [helper.make_node("Identity", ["go"], ["go_on"]), helper.make_node("Sigmoid", ["v"], ["w"])]
    outputs = [("go_on", TensorProto.BOOL, []), ("w", TensorProto.FLOAT, PLANE)]
    if collects:
        nodes.append(helper.make_node("Identity", ["w"], ["kept"]))
        outputs.append(("kept", TensorProto.FLOAT, PLANE))
    body = helper.make_graph(
        nodes,
        "body",
        [helper.make_tensor_value_info(*value) for value in values],
        [helper.make_tensor_value_info(*value) for value in outputs],
    )
    ends = ["y", "all"] if collects else ["y"]
    loop = helper.make_node("Loop", ["n", "true", "m"], ends, body=body)
    return _saved([_mean(), loop], {"n": np.array(10**15), "true": np.array(True)})


def that_never_ends() -> bytes:
    return _loop(collects=False)


def that_collects() -> bytes:
    """Every turn's result is kept."""
    return _loop(collects=True)


def with_weights_in(place: str) -> bytes:
    """Weights that are said to lie in another file."""
    model = onnx.load_from_string(_saved([_mean(), helper.make_node("Add", ["m", "w"], ["y"])]))
    weights = model.graph.initializer.add()
    weights.name, weights.data_type = "w", TensorProto.FLOAT
    weights.dims[:] = [1, 1, 1, 8]
    weights.data_location = TensorProto.EXTERNAL
    told = weights.external_data.add()
    told.key, told.value = "location", place
    return model.SerializeToString()


def that_answers(value: float) -> bytes:
    nodes = [_mean(), helper.make_node("Sub", ["m", "m"], ["z"]), helper.make_node("Add", ["z", "c"], ["y"])]
    return _saved(nodes, {"c": np.array(value, np.float32)})


def with_output(shape: tuple[int, ...]) -> bytes:
    """Something that is no depth map."""
    nodes = [
        _mean(),
        helper.make_node("ReduceMean", ["m"], ["v"], keepdims=0),
        helper.make_node("Expand", ["v", "s"], ["y"]),
    ]
    return _saved(nodes, {"s": np.array(shape)}, list(shape))
