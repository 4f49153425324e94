"""A rectifier in int8, about one and a half times as fast:  pcnet3d quantise pcnet.onnx -o pcnet-int8.onnx

Weights become whole numbers per output channel, activations per run of the layer (dynamic quantisation, so no
calibration data). Geometry, norms, attention and layers below _SMALLEST stay float32: they would gain nothing, and
the first layer reads coordinates. Weights take 7 bits: 8 overflow on x86 processors without VNNI, and are no better.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from .....pipeline.core.device import CPU, computing_on
from .....pipeline.core.errors import InputError
from .....pipeline.core.rotations import geodesic_deg
from .....pipeline.files.atomic import whole_file
from ....common.metrics import Figure
from ....rectifier.onnx import PCNetRectifier
from ...common.extras import needed_for
from ...synthetic.sample_poses import sample_poses

if TYPE_CHECKING:
    import onnx

LARGEST_CHANGE_DEG = 0.2  # mean, over sample_poses
_SMALLEST = 96  # inputs and outputs of a layer that is worth it; below are those that read coordinates
_STEPS = 63  # of a weight on each side of zero
_POSES = 2000


def quantise_file(
    source: Annotated[Path, typer.Argument(help="A rectifier's .onnx file.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The .onnx file to write.")],
) -> None:
    """Write a rectifier in int8: smaller, faster, and on average less than 0.2 degrees from the original."""
    change = quantise(source, output)
    size = [path.stat().st_size / 1e6 for path in (source, output)]
    print(f"{output}: {size[1]:.1f} MB instead of {size[0]:.1f}")
    print(
        f"rotations change by {change.p50:.2f} / {change.mean:.2f} / {change.p95:.2f} degrees (p50 / mean / p95)"
    )


@computing_on(CPU)  # which int8 is for
def quantise(source: Path, output: Path) -> Figure:
    """Write the int8 form of a rectifier's file -> how far its rotations are from the original's, in degrees.

    InputError, and no file, when the source is no rectifier, is int8 already or has no layer that is large enough,
    when the change is LARGEST_CHANGE_DEG or more on average, or when the package onnx is missing.
    """
    with needed_for("Quantising"):
        import onnx
    original = PCNetRectifier(source)
    if original.precision != "float32":
        raise InputError(
            "wrong-network",
            f"Expected a float32 network to quantise, but {source} is {original.precision} already.",
        )
    model = onnx.load_from_string(Path(source).read_bytes())
    _quantise(model, str(source))
    stated = {entry.key: entry.value for entry in model.metadata_props}
    onnx.helper.set_model_props(model, stated | {"precision": "int8", "quantised_from": original.method})
    with whole_file(output) as partial:
        onnx.save(model, str(partial))
        change = rotation_change(original, PCNetRectifier(partial))
        if not change.mean < LARGEST_CHANGE_DEG:
            raise InputError(
                "wrong-network",
                f"In int8 the rotations of {source} change by {change.mean:.2f} degrees on average, more than the "
                f"{LARGEST_CHANGE_DEG} that are allowed; it was not written.",
            )
    return change


def rotation_change(one: PCNetRectifier, other: PCNetRectifier, count: int = _POSES) -> Figure:
    """Degrees between the answers of two rectifiers to the same sample_poses."""
    joints = sample_poses(count)
    return Figure.of(geodesic_deg(one.rotation(joints)[0], other.rotation(joints)[0]))


def _quantise(model: onnx.ModelProto, name: str) -> None:
    """Replace the large layers of a float32 graph, in place, by x -> uint8, integer product, float32 with bias."""
    from onnx import helper, numpy_helper

    graph = model.graph
    constants = {entry.name: entry for entry in graph.initializer}
    nodes, known = [], set()

    def constant(of: str, what: str, value: np.ndarray) -> str:
        graph.initializer.append(numpy_helper.from_array(value, f"{of}_{what}"))
        return f"{of}_{what}"

    for node in graph.node:
        weight = _weight(node, constants)
        if weight is None or min(weight.shape) < _SMALLEST:
            nodes.append(node)
            continue
        x, y = node.input[0], node.output[0]
        if x not in known:  # queries, keys and values read the same
            known.add(x)
            nodes.append(
                helper.make_node("DynamicQuantizeLinear", [x], [f"{x}_{p}" for p in ("int", "scale", "zero")])
            )
        scale = (np.abs(weight).max(axis=0) / _STEPS).clip(1e-12).astype(np.float32)
        whole = constant(y, "weight", np.round(weight / scale).astype(np.int8))
        inputs = [
            f"{x}_int",
            whole,
            f"{x}_scale",
            constant(y, "scale", scale),
            f"{x}_zero",
            "",
            *node.input[2:3],
        ]
        nodes.append(helper.make_node("MatMulIntegerToFloat", inputs, [y], domain="com.microsoft"))
    if not known:
        raise InputError(
            "wrong-network",
            f"Expected a network with layers of {_SMALLEST} features or more to quantise in {name}, found none.",
        )
    del graph.node[:], graph.value_info[:]
    graph.node.extend(nodes)
    used = {name for node in nodes for name in node.input}
    kept = [entry for entry in graph.initializer if entry.name in used]
    del graph.initializer[:]
    graph.initializer.extend(kept)
    if all(entry.domain != "com.microsoft" for entry in model.opset_import):
        model.opset_import.append(helper.make_opsetid("com.microsoft", 1))


def _weight(node: onnx.NodeProto, constants: dict[str, onnx.TensorProto]) -> np.ndarray | None:
    """(inputs, outputs) of a fully connected layer with constant weights; None for any other node."""
    from onnx import numpy_helper

    if node.op_type not in ("Gemm", "MatMul") or node.input[1] not in constants:
        return None
    weight = numpy_helper.to_array(constants[node.input[1]])
    options = {attribute.name: attribute for attribute in node.attribute}
    if weight.ndim != 2 or ("transA" in options and options["transA"].i):
        return None
    if any(name in options and options[name].f != 1 for name in ("alpha", "beta")):
        return None
    return weight.T if "transB" in options and options["transB"].i else weight
