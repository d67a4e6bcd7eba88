"""Tiny ONNX graphs whose depth is a known function of the image."""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

OPSET = 17
IR_VERSION = 9


def save(
    path: Path,
    nodes: list,
    image: list,
    depths: list[list],
    constants: dict[str, np.ndarray] | None = None,
    metadata: dict[str, str] | None = None,
    dtype: int = TensorProto.FLOAT,
) -> Path:
    """A file whose ``nodes`` map ``x`` of shape ``image`` to ``y0``, ``y1``, ... of shapes ``depths``."""
    graph = helper.make_graph(
        nodes,
        "depth",
        [helper.make_tensor_value_info("x", dtype, image)],
        [helper.make_tensor_value_info(f"y{k}", dtype, shape) for k, shape in enumerate(depths)],
        [numpy_helper.from_array(value, name) for name, value in (constants or {}).items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    helper.set_model_props(model, metadata or {})
    onnx.checker.check_model(model)
    onnx.save(model, path)
    return path


def channel(
    path: Path,
    index: int = 0,
    image: tuple = (1, 3, 32, 48),
    times: float = 1.0,
    plus: float = 0.0,
    metadata: dict[str, str] | None = None,
    dtype: int = TensorProto.FLOAT,
) -> Path:
    """Depth is ``times`` x + ``plus`` of one channel of the input, in the input's own layout."""
    axis = 3 if image[3] == 3 else 1
    shape = list(image)
    shape[axis] = 1
    kind = helper.tensor_dtype_to_np_dtype(dtype)
    constants = {"k": np.array([index]), "a": np.array(times, kind), "b": np.array(plus, kind)}
    nodes = [
        helper.make_node("Gather", ["x", "k"], ["c"], axis=axis),
        helper.make_node("Mul", ["c", "a"], ["m"]),
        helper.make_node("Add", ["m", "b"], ["y0"]),
    ]
    return save(path, nodes, list(image), [shape], constants, metadata, dtype)


def fixed_answer(
    path: Path,
    depths: list[np.ndarray],
    image: tuple = (1, 3, 32, 48),
    metadata: dict[str, str] | None = None,
) -> Path:
    """Depths that do not look at the image."""
    nodes = [
        helper.make_node("ReduceMean", ["x"], ["n"], keepdims=0),
        helper.make_node("Sub", ["n", "n"], ["z"]),
    ]
    nodes += [helper.make_node("Add", [f"d{k}", "z"], [f"y{k}"]) for k in range(len(depths))]
    constants = {f"d{k}": depth.astype(np.float32) for k, depth in enumerate(depths)}
    return save(path, nodes, list(image), [list(depth.shape) for depth in depths], constants, metadata)


def input_side(path: Path, axis: int, metadata: dict[str, str] | None = None) -> Path:
    """Depth is the height (axis 2) or width (axis 3) that an input of free size was given."""
    nodes = [
        helper.make_node("Shape", ["x"], ["s"]),
        helper.make_node("Gather", ["s", "axis"], ["side"]),
        helper.make_node("Cast", ["side"], ["value"], to=TensorProto.FLOAT),
        helper.make_node("ReduceMean", ["x"], ["m"], axes=[1], keepdims=0),
        helper.make_node("Mul", ["m", "zero"], ["z"]),
        helper.make_node("Add", ["z", "value"], ["y0"]),
    ]
    constants = {"axis": np.array(axis), "zero": np.array(0.0, np.float32)}
    return save(path, nodes, [1, 3, "height", "width"], [[1, "height", "width"]], constants, metadata)


def completion(
    path: Path,
    nodes: list,
    inputs: dict[str, tuple],
    output: tuple = (1, 1, 48, 64),
    constants: dict[str, np.ndarray] | None = None,
    metadata: dict[str, str] | None = None,
    types: dict[str, int] | None = None,
    name: str = "depth_out",
) -> Path:
    """A file whose ``nodes`` map inputs of these shapes, float unless ``types`` says so, to one output."""
    kinds = dict.fromkeys(inputs, TensorProto.FLOAT) | (types or {})
    graph = helper.make_graph(
        nodes,
        "completion",
        [helper.make_tensor_value_info(key, kinds[key], shape) for key, shape in inputs.items()],
        [helper.make_tensor_value_info(name, kinds.get("depth", TensorProto.FLOAT), output)],
        [numpy_helper.from_array(value, key) for key, value in (constants or {}).items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    helper.set_model_props(model, metadata or {})
    onnx.checker.check_model(model)
    onnx.save(model, path)
    return path
