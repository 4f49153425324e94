"""What was seen in a take, in plain words: what its measures and angles come to, each figure with its error."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .measures import nested
from .messages import how_many
from .take import Take

_NINE_IN_TEN = 1.645  # standard deviations
_MOST = 4  # depths that are told one by one
_TIMES = ("never", "once", "twice")
# What is told of the joints: where movements were recognised, and where none were.
_MOVED = ("knee_flexion",)
_RAISED = ("shoulder_elevation",)
_ALL = ("knee_flexion", "hip_flexion", "shoulder_elevation", "elbow_flexion", "trunk_lean_sagittal")
_JOINTS = {
    "knee_flexion": "knees", "hip_flexion": "hips", "elbow_flexion": "elbows",
    "shoulder_elevation": "arms from hanging", "trunk_lean_sagittal": "trunk forward",
}  # fmt: skip


def answer(take: Take) -> list[str]:
    """Sentences about a take's movements: steps, knee bends, raised arms, jumps, and the range of the main joints. What
    was not recognised is not told, but that nothing was, or why steps cannot be counted; nothing of a take without
    measures."""
    measures = nested(take.measures or ())
    if not measures:
        return []
    poses = take.need("poses")
    metric = poses.frame.unit == "m"
    walking, bends = measures.get("walking", {}), measures.get("knee_bends", {})
    legs = [*_walked(walking, metric), *_bent(bends)]
    arms = _raised(measures.get("arm_raises", {}))
    done = [*legs, *arms, *_jumped(measures.get("jumps", {}), metric)]
    shown = (*(_MOVED if legs or not arms else ()), *(_RAISED if arms else ())) if done else _ALL
    joints = [words for name in shown if (words := _range(measures.get("range_of_motion", {}), name))]
    if not done:
        seconds = poses.times[-1] - poses.times[0]
        done = [f"no walking, knee bends, raised arms or jumps were recognised in {seconds:.1f} s"]
    why = str(walking.get("reason", ""))
    unseen = [why] if why.startswith("steps cannot be counted") else []
    return [
        f"{words[:1].upper()}{words[1:]}." for words in ("; ".join(done), "; ".join(joints), *unseen) if words
    ]


def _walked(walking: Mapping[str, Any], metric: bool) -> list[str]:
    steps = walking.get("steps", 0)
    if not steps:
        return []
    words = f"{'ran' if walking.get('gait') == 'running' else 'walked'} {how_many(steps, 'step')}"
    landed = [at for side in ("right", "left") for at in walking.get(side, {}).get("landings_s", ())]
    if walking.get("walks") == 1 and landed:
        words += f" in {max(landed) - min(landed):.1f} s"
    if "cadence_spm" in walking:
        words += f", {_figure(walking, 'cadence_spm', 'cadence_error_spm')} a minute"
    if metric and "walking_speed" in walking:
        words += f", at {_figure(walking, 'walking_speed', 'walking_speed_error')} m/s"
    return [words]


def _bent(bends: Mapping[str, Any]) -> list[str]:
    count, squats = bends.get("count", 0), bends.get("squats", 0)
    if not count:
        return []
    if squats == count:
        return [f"squatted {_counted([bends])}"]
    among = f", {how_many(squats, 'squat')} among them" if squats else ""
    return [f"bent the knees {_counted([bends])}{among}"]


def _raised(arms: Mapping[str, Any]) -> list[str]:
    sides = {side: arms.get(side, {}) for side in ("right", "left")}
    right, left = ((of.get("count", 0), of.get("count_reason")) for of in sides.values())
    if right == left and right[0]:
        return [f"raised both arms {_counted(sides.values())}"]
    return [f"raised the {side} arm {_counted([of])}" for side, of in sides.items() if of.get("count")]


def _counted(groups: Iterable[Mapping[str, Any]]) -> str:
    """Such as "3 times to 102 ± 7 degrees"; and when there may have been more that nobody saw. groups: of one count."""
    groups = list(groups)
    often, unseen = _often(groups[0]["count"]), groups[0].get("count_reason")
    return f"{f'at least {often} ({unseen})' if unseen else often}{_peaks(groups)}"


def _peaks(groups: Sequence[Mapping[str, Any]]) -> str:
    """Such as " to 102 ± 7 degrees"; of several their lowest and highest, and the largest error."""
    peaks = [round(peak) for of in groups for peak in of.get("peak_deg", ())]
    errors = [error for of in groups for error in of.get("peak_error_deg", ())]
    if not peaks:
        return ""
    ends = f"to {peaks[0]}" if min(peaks) == max(peaks) else f"to between {min(peaks)} and {max(peaks)}"
    return f" {ends} degrees{f' (± {max(errors):.0f})' if errors else ''}"


def _jumped(jumps: Mapping[str, Any], metric: bool) -> list[str]:
    count = jumps.get("count", 0)
    if not count:
        return []
    heights = [f"{height:.2f}" for height in jumps.get("jump_height", ())] if metric else []
    return [f"jumped {_often(count)}" + (f", {_and(heights)} m high" if 0 < len(heights) <= _MOST else "")]


def _range(ranges: Mapping[str, Mapping[str, Any]], name: str) -> str:
    """Such as "knees 3 to 58 (right) and 2 to 68 degrees (left), each within 9"; empty where no side is to be
    believed."""
    sides = {"": ranges.get(name)} if name in ranges else {
        side: ranges.get(f"{side[0]}_{name}") for side in ("right", "left")
    }  # fmt: skip
    known = {
        side: of for side, of in sides.items() if of and "p05_deg" in of and not of.get("beyond_anatomy_frames")
    }  # fmt: skip
    if not known:
        return ""
    parts = [
        f"{of['p05_deg']:z.0f} to {of['p95_deg']:z.0f}{f' ({side})' * bool(side)}"
        for side, of in known.items()
    ]
    errors = [_NINE_IN_TEN * of["sd_deg"] for of in known.values() if "sd_deg" in of]
    within = f", {'each ' * (len(known) > 1)}within {max(errors):.0f}" if errors else ""
    return f"{_JOINTS[name]} {' and '.join(parts)} degrees{within}"


def _figure(of: Mapping[str, Any], key: str, error: str) -> str:
    return f"{of[key]:g}" + (f" ± {of[error]:g}" if error in of else "")


def _often(count: int) -> str:
    return _TIMES[count] if count < len(_TIMES) else f"{count} times"


def _and(words: Sequence[str]) -> str:
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
