"""Accelerations of wrists and ankles against motion capture: what a rotation does to a signal.

Joints relative to the pelvis, both sides low-passed at 6 Hz without delay (pipeline/motion/signals.py). A lift is
brought to the truth's scale, one factor a take. Three comparisons, vertical and horizontal apart:

- "level": in upright axes with one heading for the take, the truth's for every method. A method that answers frame by
  frame has its frames' own ups there, turned to that heading frame by frame; so only its tilt counts against it. It
  is the fair one: all methods and the camera's axes meet one truth.
- "lift": the same signals against the same lift in the true axes: what the method's rotation alone adds.
- "body": R^T x, what the paper computes, against the true R^T x. The axes turn with the person, so it holds the
  jitter of the frames' headings too; one heading offset a take is taken out. The camera's axes have no place in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...pipeline.layouts import H36M17
from ...pipeline.motion.signals import CUTOFF_HZ, derivative, lowpass
from ...pipeline.rotations import rotate, transpose
from ..common.metrics import Figure
from .take_answers import CAMERA_AXES, TRUE_AXES, Answer, with_heading

NO_MOTION = "no motion"
PARTS = {part: H36M17.indices((f"l_{part}", f"r_{part}")) for part in ("wrist", "ankle")}
_COLUMNS = [(part, direction) for part in PARTS for direction in ("vertical", "horizontal")]


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps: pipeline/motion/signals.py's filter and derivative."""
    flat = lowpass(path.reshape(len(path), -1), time_s, CUTOFF_HZ)
    return derivative(flat, time_s, order=2).reshape(path.shape)


def compare(signal: np.ndarray, truth: np.ndarray) -> dict[str, tuple[float, float]]:
    """{"vertical", "horizontal": (RMSE, r)} of accelerations (N, J, 3), z up. Horizontal is both axes in one: root
    mean square of an axis, and one correlation."""
    parts = {"vertical": slice(2, 3), "horizontal": slice(0, 2)}
    return {name: agreement(signal[..., axes], truth[..., axes]) for name, axes in parts.items()}


def norms(signal: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """RMSE and r of the magnitudes of accelerations (N, J, 3), which one rotation for the take cannot change."""
    return agreement(np.linalg.norm(signal, axis=-1), np.linalg.norm(truth, axis=-1))


def take_scores(
    answers: dict[str, Answer],
    joints: np.ndarray,
    truth: np.ndarray,
    R_camera_from_world: np.ndarray,
    R_camera_from_body: np.ndarray,
    time_s: np.ndarray,
) -> dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]]:
    """One take: {"level", "lift", "body", "norm": {method: {part: {direction: (RMSE, r)}}}}; "lift" of a lift only.

    joints, truth: (T, 17, 3) metres, CAMERA axes relative to the pelvis, without gaps. R_camera_from_world: (3, 3) and
    R_camera_from_body: (T, 3, 3), the truth. "level" also has the row of who says that nothing moves.
    The directions of "norm" are just "norm", its method "any".
    """
    R_world = np.broadcast_to(R_camera_from_world, R_camera_from_body.shape)
    world, lift, body = (
        _limbs(*pair, time_s) for pair in ((truth, R_world), (joints, R_world), (truth, R_camera_from_body))
    )
    lifted = not np.array_equal(joints, truth)
    scores: dict[str, dict[str, dict[str, dict[str, tuple[float, float]]]]] = {
        "level": {NO_MOTION: {part: compare(np.zeros_like(world[part]), world[part]) for part in PARTS}},
        **({"lift": {}} if lifted else {}),
        "body": {},
    }
    for name, answer in answers.items():
        signal = _limbs(joints, answer.axes(R_camera_from_world), time_s)
        scores["level"][name] = {part: compare(signal[part], world[part]) for part in PARTS}
        if lifted and name != TRUE_AXES:
            scores["lift"][name] = {part: compare(signal[part], lift[part]) for part in PARTS}
        if answer.R_camera_from_level is None or answer.levelled is not None:
            signal = _limbs(joints, with_heading(answer.R_camera_from_body, R_camera_from_body), time_s)
            scores["body"][name] = {part: compare(signal[part], body[part]) for part in PARTS}
    camera = _limbs(joints, np.broadcast_to(np.eye(3), R_camera_from_body.shape), time_s)
    scores["norm"] = {"any": {part: {"norm": norms(camera[part], world[part])} for part in PARTS}}
    return scores


def over_takes(scores: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """take_scores of many takes as {axes: {method: {part: {direction: {"rmse", "r": Figure}}}}}, over takes."""

    def join(nodes: Sequence[Any]) -> Any:
        if isinstance(nodes[0], dict):
            return {key: join([node[key] for node in nodes]) for key in nodes[0]}
        rmse, r = np.array(nodes).T
        return {"rmse": Figure.of(rmse), "r": Figure.of(r)}

    return join(scores) if scores else {}


def as_markdown(sets: dict[str, Any]) -> list[str]:
    """Tables of {set: {"takes": count, "left out": count, **over_takes}}."""
    lines = [
        "## Acceleration of wrists and ankles",
        "",
        f"Relative to the pelvis, {CUTOFF_HZ:g} Hz zero-phase, against motion capture; RMSE in m/s^2 (horizontal: of "
        "one axis), p50 / mean / p95 over takes, and r, p50. Upright takes of 2 s and more without gaps.",
    ]
    titles = {
        "level": "In upright axes, one heading for the take, the same for every method; frame by frame: each frame's "
        "own up under it. `true axes` is what is left when the rotation is right.",
        "lift": "The same against the same lift in the true axes: what the rotation alone adds.",
        "body": "In BODY, the paper's R^T x, against the true one.",
    }
    for label, values in sets.items():
        if not values["takes"]:
            continue
        gaps = f", {values['left out']} with gaps left out" if values["left out"] else ""
        lines += ["", f"### {label}, {values['takes']} takes{gaps}"]
        for axes in (axes for axes in titles if axes in values):
            lines += ["", titles[axes], "", *_head()]
            for method, row in values[axes].items():
                lines.append(_row([method, *(_cell(row[part][direction]) for part, direction in _COLUMNS)]))
        norm = values["norm"]["any"]
        lines += ["", "The norm, which one rotation for the take cannot change: "]
        lines[-1] += "; ".join(f"{part} {_cell(norm[part]['norm'])}" for part in PARTS) + "."
    return [*lines, "", *_ratios(sets)]


def _ratios(sets: dict[str, Any]) -> list[str]:
    """How many times smaller the RMSE of one gravity a take is than that of its rectifier's frames, and of the
    camera's axes."""
    if not any(values["takes"] for values in sets.values()):
        return []
    lines = [
        "### One gravity a take against the rest",
        "",
        "How many times smaller its RMSE is, of the p50 and of the means over takes; below 1 it is larger. Aimed at: 2 "
        "against its rectifier's frames, more than 1 against the camera's axes.",
        "",
        *_head(),
    ]
    for label, values in sets.items():
        for axes in (axes for axes in ("level", "lift") if axes in values):
            what = f"{label}, {'against motion capture' if axes == 'level' else 'what the rotation adds'}"
            rows = values[axes]
            for take in (name for name in rows if name.endswith(", a take")):
                frames = take.replace(", a take", ", a frame")
                for against, other in (("its frames", frames), (CAMERA_AXES, CAMERA_AXES)):
                    pairs = [[rows[m][part][way]["rmse"] for m in (other, take)] for part, way in _COLUMNS]
                    cells = [f"{a.p50 / b.p50:.2f} / {a.mean / b.mean:.2f}" for a, b in pairs]
                    lines.append(_row([f"{what}: {take}, against {against}", *cells]))
    return lines


def _head() -> list[str]:
    return [_row(["", *(", ".join(column) for column in _COLUMNS)]), _row(["---"] * (len(_COLUMNS) + 1))]


def _limbs(joints: np.ndarray, R_camera_from_axes: np.ndarray, time_s: np.ndarray) -> dict[str, np.ndarray]:
    """Accelerations of each part's joints in other axes."""
    turned = rotate(transpose(R_camera_from_axes), joints)
    return {part: accelerations(turned[:, rows], time_s) for part, rows in PARTS.items()}


def agreement(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Root mean square of a - b, each (...), and their correlation; NaN where one of them does not vary."""
    a, b = a.ravel(), b.ravel()
    rmse = float(np.sqrt(np.mean((a - b) ** 2)))
    moving = min(a.std(), b.std()) > 1e-9
    return rmse, float(np.corrcoef(a, b)[0, 1]) if moving else float("nan")


def _cell(score: dict[str, Figure]) -> str:
    r = score["r"].p50
    return f"{score['rmse']:.2f}" + (f"; r {r:.2f}" if np.isfinite(r) else "")


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
