"""A rectifier in int8, a third faster:  pcnet3d quantise pcnet.onnx -o pcnet-int8.onnx

Weights become whole numbers per output channel, activations per run of the layer (onnxruntime's dynamic quantisation,
so no calibration). Geometry, norms, attention and layers below _SMALLEST stay float32: they would gain nothing, and
the first layer reads coordinates. Weights take 7 bits: 8 overflow on x86 processors without VNNI, and are no better.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .....pipeline.core.device import CPU, computing_on
from .....pipeline.core.errors import InputError
from .....pipeline.core.extras import needed_for
from .....pipeline.core.rotations import geodesic_deg
from .....pipeline.files.atomic import whole_file
from ....common.metrics import Figure
from ....rectifier.onnx import PCNetRectifier
from ...synthetic.sample_poses import sample_poses

LARGEST_CHANGE_DEG = 0.2  # mean, over sample_poses
_SMALLEST = 96  # inputs and outputs of a layer that is worth it; below are those that read coordinates
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
        from onnxruntime.quantization import quantize_dynamic
    original = PCNetRectifier(source)
    if original.precision != "float32":
        raise InputError(
            "wrong-network",
            f"Expected a float32 network to quantise, but {source} is {original.precision} already.",
        )
    model = onnx.load_from_string(Path(source).read_bytes())
    stated = {entry.key: entry.value for entry in model.metadata_props}
    shapes = {entry.name: entry.dims for entry in model.graph.initializer}
    connected = [node for node in model.graph.node if node.op_type in ("Gemm", "MatMul")]
    layers = [node.name for node in connected if min(shapes.get(node.input[1], (0,))) >= _SMALLEST]
    if not layers:
        raise InputError(
            "wrong-network",
            f"Expected a network with layers of {_SMALLEST} features or more to quantise in {source}, found none.",
        )
    onnx.helper.set_model_props(model, {"onnx.quant.pre_process": "onnxruntime.quant"})  # else it warns
    with whole_file(output) as partial:
        quantize_dynamic(
            model, partial, ["Gemm", "MatMul"], per_channel=True, reduce_range=True,
            nodes_to_quantize=[*layers, *(f"{name}_MatMul" for name in layers)],  # a Gemm is split in two
        )  # fmt: skip
        whole = onnx.load(str(partial))
        onnx.helper.set_model_props(whole, stated | {"precision": "int8", "quantised_from": original.method})
        onnx.save(whole, str(partial))
        joints = sample_poses(_POSES)
        before, after = (network.rotation(joints)[0] for network in (original, PCNetRectifier(partial)))
        change = Figure.of(geodesic_deg(before, after))
        if not change.mean < LARGEST_CHANGE_DEG:
            raise InputError(
                "wrong-network",
                f"In int8 the rotations of {source} change by {change.mean:.2f} degrees on average, more than the "
                f"{LARGEST_CHANGE_DEG} that are allowed; it was not written.",
            )
    return change
