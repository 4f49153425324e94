"""How fast rectifiers are on this machine, beside what its processor can do:  pcnet3d bench rectify -o bench.json

Speeds of shared machines drift, so everything is measured in turns, several rounds, and a network's share of the
machine's speed is taken within each round.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ....pipeline.core.device import CPU, computing_on, placement
from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import refuse_unwritable_file, whole_file
from ....pipeline.reading.settings import OnDevice
from ...common.metrics import plain
from ...common.onnx import session_of
from ...gravity.live import LiveRectifier
from ...rectifier.load import load_rectifier
from ...rectifier.onnx import PCNetRectifier
from ..common.extras import needed_for
from ..synthetic.sample_poses import sample_poses
from ..training.rectifier.quantise import quantise, rotation_change

if TYPE_CHECKING:
    import onnx

_GEMM = 1024  # rows and columns of the matrices that tell the machine's speed
_GEMM_RUNS = 10  # a round and thread
_SINGLES = 300
_STARTS = 3
_FIRST_POSE = (
    "import sys, numpy; from pcnet3d.models import load_rectifier; "
    "from pcnet3d.pipeline.core.device import computing_on\n"
    "with computing_on(sys.argv[2]): "
    "load_rectifier(sys.argv[1]).rotation(numpy.random.default_rng(0).normal(size=(1, 17, 3)))"
)


def rectify(
    rectifier: Annotated[
        list[str], typer.Option(help="A network by name, or its .onnx file; repeatable.")
    ] = ["pcnet"],  # noqa: B006 (typer copies it)
    count: Annotated[int, typer.Option(min=1, help="Poses per batch.")] = 10_000,
    rounds: Annotated[int, typer.Option(min=1, help="How often everything is measured.")] = 5,
    threads: Annotated[
        int | None, typer.Option(min=1, help="CPU threads; by default all that the process may use.")
    ] = None,
    device: OnDevice = "auto",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Also write this JSON file.")] = None,
) -> None:
    """Measure a rectifier's speed, in float32 and in int8, beside the machine's own speed."""
    if output is not None:
        refuse_unwritable_file(output)
    with computing_on(device) as where:
        results = {**measure(rectifier, count, rounds, threads), "device": where.summary()}
    if output is not None:
        output.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(output) as partial_:
            partial_.write_text(json.dumps(plain(results), indent=1) + "\n", encoding="utf-8")
    print(as_text(results))


def measure(names: list[str], count: int, rounds: int, threads: int | None = None) -> dict[str, Any]:
    """Everything that is printed. Of every float32 network the int8 form is made and measured as well.

    InputError for a name that is no network, or when the package onnx is missing.
    """
    with needed_for("Measuring"):
        import onnx
    import onnxruntime

    opened = {name: _open(name, threads) for name in names}
    poses = sample_poses(count)
    results: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, network) in enumerate(list(opened.items())):
            results[name] = {"method": network.method, "mflop": flops(onnx.load(network.path)) / 1e6}
            if network.precision == "float32":
                _tell(f"{name}: int8")
                path = Path(folder) / f"{number}.onnx"
                try:
                    quantise(network.path, path)
                except InputError as error:
                    _tell(str(error))
                    continue
                opened[f"{name} int8"] = int8 = PCNetRectifier(path, threads)
                results[f"{name} int8"] = {
                    "method": int8.method,
                    "mflop": results[name]["mflop"],
                    "of": name,
                    "rotation_change_deg": rotation_change(network, int8),
                }
        for name, network in opened.items():
            _tell(f"{name}: start, single poses and live")
            results[name] |= {
                "start_s": _start_s(network.path, placement().asked),
                "single_ms": _frame_ms(lambda pose, _, network=network: network.rotation(pose[None]), poses),
                "live_ms": _frame_ms(LiveRectifier(network).update, poses),
            }
        workers = next(iter(opened.values())).threads
        jobs: dict[str, Callable[[], float]] = {"GEMM": partial(_gemm_rate, _gemm_session(), workers)}
        jobs |= {name: partial(_poses_per_s, network, poses) for name, network in opened.items()}
        speeds: dict[str, list[float]] = {name: [] for name in jobs}
        for turn in range(rounds):
            _tell(f"{count:,} poses, round {turn + 1} of {rounds}")
            for name, job in jobs.items():
                speeds[name].append(job())
    gemm = np.array(speeds.pop("GEMM"))
    for name, values in speeds.items():
        result, rate = results[name], np.array(values)
        result["poses_per_s"] = float(np.median(rate))
        if "of" in result:
            result["speed_ratio"] = float(np.median(rate / np.array(speeds[result["of"]])))
        result["share_of_gemm"] = float(np.median(rate * result["mflop"] / 1e3 / gemm))
    return {
        "pcnet3d": package_version(), "onnxruntime": onnxruntime.__version__, "threads": workers, "poses": count,
        "rounds": rounds, "gemm_gflops": float(np.median(gemm)), "rectifiers": results,
    }  # fmt: skip


def flops(model: onnx.ModelProto) -> float:
    """Floating-point operations of the matrix products for one pose, a multiplication and an addition being two;
    NaN for a graph with products of integers, which are none."""
    import onnx

    model = onnx.ModelProto.FromString(model.SerializeToString())
    if any("Integer" in node.op_type for node in model.graph.node):
        return float("nan")
    for entry in model.graph.input:
        entry.type.tensor_type.shape.dim[0].dim_value = 1
    del model.graph.value_info[:]
    graph = onnx.shape_inference.infer_shapes(model, strict_mode=True, data_prop=True).graph
    shape = {entry.name: list(entry.dims) for entry in graph.initializer}
    for entry in (*graph.input, *graph.value_info, *graph.output):
        shape[entry.name] = [size.dim_value for size in entry.type.tensor_type.shape.dim]
    total = 0
    for node in graph.node:
        if node.op_type in ("MatMul", "Gemm"):
            transposed = any(option.name == "transA" and option.i for option in node.attribute)
            total += 2 * prod(shape[node.output[0]]) * shape[node.input[0]][0 if transposed else -1]
        elif node.op_type == "Einsum":
            (equation,) = (option.s.decode() for option in node.attribute if option.name == "equation")
            terms = equation.replace(" ", "").partition("->")[0].split(",")
            sizes = {
                letter: size
                for term, x in zip(terms, node.input, strict=True)
                for letter, size in zip(term, shape[x], strict=True)
            }
            total += 2 * prod(sizes.values())
    return float(total)


def as_text(results: dict[str, Any]) -> str:
    """A few lines for the terminal."""
    lines = [
        f"fp32 GEMM (onnxruntime {results['onnxruntime']}, {_GEMM} x {_GEMM} x {_GEMM}, "
        f"{results['threads']} at a time): {results['gemm_gflops']:.0f} GFLOP/s"
    ]
    for name, row in results["rectifiers"].items():
        text = f"{name}: {row['poses_per_s']:,.0f} poses/s"
        if "of" in row:
            change = row["rotation_change_deg"]
            text += f" ({row['speed_ratio']:.2f} times {row['of']}), rotations change by "
            text += f"{change.p50:.2f} / {change.mean:.2f} / {change.p95:.2f} degrees (p50 / mean / p95)"
        elif np.isfinite(row["mflop"]):
            text += f" of {row['mflop']:.1f} MFLOP, {100 * row['share_of_gemm']:.0f} % of the GEMM rate"
        for kind, taken in (("a single pose", row["single_ms"]), ("live, a frame", row["live_ms"])):
            text += f"; {kind} {taken['p50']:.2f} ms (p50), {taken['p95']:.2f} ms (p95)"
        lines.append(f"{text}; a new process's first pose after {row['start_s']:.2f} s")
    elsewhere = {name: device for name, device in results["device"]["networks"].items() if device != CPU}
    lines += [f"{name} computed on {device}; the GEMM on the CPU" for name, device in elsewhere.items()]
    return "\n".join(lines)


def _open(name: str, threads: int | None) -> PCNetRectifier:
    network = load_rectifier(name)
    if not isinstance(network, PCNetRectifier):
        raise InputError(
            "bad-value",
            f"Expected a network to measure, got the rectifier '{name}'; give pcnet or an .onnx file.",
        )
    return PCNetRectifier(network.path, threads)


def _gemm_session() -> Any:
    """MatMul of a (_GEMM, _GEMM) pair, in one thread."""
    from onnx import TensorProto, helper

    a, b, c = (helper.make_tensor_value_info(name, TensorProto.FLOAT, [_GEMM, _GEMM]) for name in "abc")
    graph = helper.make_graph([helper.make_node("MatMul", ["a", "b"], ["c"])], "gemm", [a, b], [c])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=9)
    return session_of(model.SerializeToString(), threads=1)


def _gemm_rate(session: Any, threads: int) -> float:
    """GFLOP/s of that many products at the same time, as the rectifier works on chunks."""
    rng = np.random.default_rng(0)
    matrices = {name: rng.standard_normal((_GEMM, _GEMM), dtype=np.float32) for name in "ab"}
    runs = _GEMM_RUNS * threads
    start = time.perf_counter()
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda _: session.run(None, matrices), range(runs)))
    return 2 * _GEMM**3 * runs / (time.perf_counter() - start) / 1e9


def _poses_per_s(network: PCNetRectifier, poses: np.ndarray) -> float:
    start = time.perf_counter()
    network.rotation(poses)
    return len(poses) / (time.perf_counter() - start)


def _frame_ms(answer: Callable[[np.ndarray, float], object], poses: np.ndarray) -> dict[str, float]:
    """Of answer(pose (17, 3), its time in seconds), at 30 frames a second."""
    taken = []
    for number in range(_SINGLES):
        start = time.perf_counter()
        answer(poses[number % len(poses)], number / 30)
        taken.append(1000 * (time.perf_counter() - start))
    return {"p50": float(np.median(taken)), "p95": float(np.quantile(taken, 0.95))}


def _start_s(path: Path, device: str) -> float:
    """A fresh interpreter's imports, loading and first pose; the median of a few."""
    taken = []
    for _ in range(_STARTS):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", _FIRST_POSE, str(path), device], check=True)
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))


def _tell(text: str) -> None:
    print(text, file=sys.stderr)
