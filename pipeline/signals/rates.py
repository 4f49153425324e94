"""Frame rates to be believed: those that a user gives, those that a file states, and what movement says of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ..core.anthropometry import implied_stature
from ..core.errors import InputError
from ..core.layouts import H36M17
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import angle_deg
from ..core.take import Video
from .filters import breaks, derivative
from .flights import falls

_RATES = (1.0, 1000.0)  # of video; fewer frames carry no movement, and more a camera for people does not take
_TOLERANCE = 0.01  # of a rate: 29.97 is 30
_SLOWED = 1.05  # times as many frames captured as shown: slow motion
_ENDS = ("r_wrist", "l_wrist", "r_ankle", "l_ankle")
# The fastest hand or foot against the pelvis, in statures a second, in the fastest hundredth of the frames. Elite
# sprinters' feet and boxers' fists reach 5 to 7 (about 10 m/s); an arm raised in 5 s makes 0.2.
_SPEEDS = (0.15, 8.0)
_MOVES = 0.15  # statures: how far a hand or foot goes at least before slowness says anything
_FALL = 9.81 / 1.7  # statures / s2 of an adult; of people 1.2 to 2 m tall it is within a fifth of the pace
_PACE = 1.5  # times too slow, or too fast; slow motion is of twice and more
_STEPS_PER_MIN = (40.0, 240.0)  # stroke patients walk at 45 and more, sprinters run at up to 300
_UNHURRIED = 1.0  # statures a second: limbs of a walk at under 40 steps have 0.7, a skater's, who glides, 2.1
_STEP = 0.25  # legs: by how much the ankles' separation changes from step to step at least
_FEWEST = 4  # steps
_WALKS_DEG = 32.0  # of the knee that bears the body as the legs pass: lifted walks have 11 to 30 and the
# longest strides 36, lifted runs 34 and more, of which only what no run has is told
# Of the times from passing to passing, and the spread of how far the ankles come apart.
_EVEN, _ALIKE = 1.35, 0.2


# Notices that leave the rate open, but for what a user says against the file.
_AGAINST = frozenset(
    (
        "slow-motion-stated", "clocks-contradict", "falls-slowly", "falls-fast", "moves-slowly", "moves-fast",
        "gait-against-rate",
    )
)  # fmt: skip


class _Limit(NamedTuple):
    usual: float
    limit: float


# Long steps take their time, for legs swing as pendulums do: seconds from passing to passing, for each length of a leg
# that the ankles come apart, are 0.50 to 0.98 in 23 lifted validation walks. Slow steps are short (the walk ratio:
# Sekiya & Nagasaki, Gait Posture 7(3), 1998): seconds times lengths are 0.38 to 0.76, and less of patients. Twice the
# rate, or half of it, is told of most; a quarter more or less is within what people do. No lifted validation take is
# beyond the limits
# (34 of 67 pass their legs evenly).
_SLOW = _Limit(0.44, 0.82)
_QUICK = {"walk": _Limit(0.68, 0.47), "run": _Limit(0.40, 0.22)}
_REGULAR = 2.0  # times the duration of a quicker step; feet that pass each other at odd times are no gait


def check_fps(fps: float, flag: str = "--fps", most: float = _RATES[1]) -> float:
    """The rate itself. InputError for one outside 1 to `most` a second. flag: of the option that gives it."""
    if not _RATES[0] <= fps <= most:
        raise InputError(
            "bad-value",
            f"Expected a rate of {_RATES[0]:g} to {most:g} a second ({flag}), got {fps:g}; give that of the recording.",
        )
    return fps


def rate_doubts(given: float | None, video: Video | None, stated: float | None = None) -> list[Notice]:
    """Notices where the rate that is used contradicts the file.

    given: frames a second that the user gives, None to take the video's; stated: those of a file of keypoints or poses,
    which count where there is no video.
    """
    shown = stated if video is None else video.fps
    captured = None if video is None else video.capture_fps
    used = shown if given is None else given
    if used is None or shown is None or not np.isfinite([used, shown]).all():
        return []
    if captured is not None and captured > _SLOWED * shown:
        if abs(used / captured - 1) <= _TOLERANCE:
            return []
        rates: dict[str, Any] = {"captured_fps": captured, "shown_fps": shown, "used_fps": used}
        return [notice("slow-motion-stated", **rates, times=captured / used)]
    if abs(used / shown - 1) <= _TOLERANCE:
        return []
    source = "file" if video is None else "video"
    return [notice("fps-contradicts", used_fps=used, source=source, shown_fps=shown, times=used / shown)]


def against_rate(said: Iterable[Notice]) -> list[Notice]:
    """Those by which the frame rate may be wrong, and with it all times and speeds."""
    return [each for each in said if each.code in _AGAINST]


def timed(poses: PoseSequence, fps: float) -> PoseSequence:
    """The poses with the times of their video frames at this rate; a notice says where a clock of their own says
    otherwise. InputError as for `check_fps`."""
    check_fps(fps)
    doubts = rate_doubts(fps, None, poses.fps if poses.time_s is not None and len(poses) > 1 else None)
    return poses.with_(time_s=poses.frame_index / fps).noted("fps", given=fps).saying(*doubts)


def fall_doubts(level: PoseSequence) -> list[Notice]:
    """Notices where a person in the air falls slower or faster than gravity pulls, as in slow motion.

    level: as for `falls`; nothing is said where no flight is well seen.
    """
    found = falls(level)
    slowed = np.sqrt(_FALL / np.median(found)) if len(found) else 1.0
    if 1 / _PACE < slowed < _PACE:
        return []
    captured = float(f"{level.fps * slowed:.2g}")
    code, times = ("falls-slowly", slowed) if slowed > 1 else ("falls-fast", 1 / slowed)
    share = float(1 / slowed**2)
    return [notice(code, flights=len(found), share=share, times=float(times), fps=captured)]


def pace_doubts(path: PoseSequence) -> list[Notice]:
    """Notices where the body moves slower or faster than people do, so that the frame rate is to be doubted.

    path: H36M17 relative to the pelvis with times, low-pass filtered, in any axes. Stature is taken from the limbs.
    """
    if len(path) < 2 or path.time_s is None:
        return []
    joints = path.joints
    stature = implied_stature(joints)
    if not stature > 0:
        return []
    velocities = [
        derivative(path.joint(end).astype(np.float64), path.times, breaks(path), 1) for end in _ENDS
    ]
    speeds = np.linalg.norm(velocities, axis=-1) / stature
    known = speeds[np.isfinite(speeds)]
    if not len(known):
        return []
    fastest = max(float(np.percentile(one[np.isfinite(one)], 99)) for one in speeds if np.isfinite(one).any())
    found = f"hands and feet move at up to {fastest:.2g} body heights a second"
    slow, fast = False, fastest > _SPEEDS[1]
    if fastest < _SPEEDS[0]:
        slow = _reach(joints[:, H36M17.indices(_ENDS)]) > _MOVES * stature
    gait = _gait(joints, path.times)
    if not (slow or fast) and gait is not None:
        if said := _against_rate(gait, path.fps):
            return [said]
        slow = gait.cadence < _STEPS_PER_MIN[0] and fastest < _UNHURRIED
        fast = gait.cadence > _STEPS_PER_MIN[1]
        found = f"the legs pass each other {gait.cadence:.0f} times a minute"
    if not (slow or fast):
        return []
    return [notice("moves-slowly" if slow else "moves-fast", fps=path.fps, found=found)]


def _against_rate(gait: _Gait, fps: float) -> Notice | None:
    """A notice where legs that walk or run, by how far the knee is bent that bears the body as they pass each other,
    swing faster or slower than legs of that stride do."""
    if not gait.even or np.isnan(gait.knee_deg):
        return None
    walks = gait.knee_deg < _WALKS_DEG
    quick, slow = _QUICK["walk" if walks else "run"], _SLOW
    values: dict[str, Any] = {"gait": "walk" if walks else "run", "step_s": gait.step_s}
    if (times := quick.usual * gait.reach / gait.step_s) > quick.usual / quick.limit:
        return notice("gait-against-rate", fps=fps, times=times, fits=fps / times, way="quickly", **values)
    if (times := gait.step_s * gait.reach / slow.usual) > slow.limit / slow.usual:
        return notice("gait-against-rate", fps=fps, times=times, fits=fps * times, way="slowly", **values)
    return None


def _reach(ends: np.ndarray) -> float:
    """The longest way across of any of the paths (T, N, 3), the outermost twentieths of the frames left out."""
    known = ends[np.isfinite(ends).all(axis=(1, 2))]
    if not len(known):
        return 0.0
    low, high = np.percentile(known, [5, 95], axis=0)
    return float(np.linalg.norm(high - low, axis=-1).max())


@dataclass(frozen=True)
class _Gait:
    """Legs that pass each other at least four times, evenly. step_s: median time from one passing to the next; reach:
    how far the ankles come apart between, in lengths of a leg; even: whether these are alike; knee_deg: median flexion
    of the straighter knee as they pass."""

    step_s: float
    reach: float
    even: bool
    knee_deg: float

    @property
    def cadence(self) -> float:
        """Passings a minute."""
        return 60 / self.step_s


def _gait(joints: np.ndarray, time_s: np.ndarray) -> _Gait | None:
    """Of joints (T, 17, 3) at time_s (T,); None where the ankles do not pass each other evenly."""
    at = {name: joints[:, i] for i, name in enumerate(H36M17.joints)}
    hips, trunk = at["l_hip"] - at["r_hip"], at["thorax"] - at["pelvis"]
    forward = np.cross(hips, trunk)
    norm = np.linalg.norm(forward, axis=-1)
    leg = sum(
        np.linalg.norm(at[f"l_{b}"] - at[f"l_{a}"], axis=-1) for a, b in pairwise(("hip", "knee", "ankle"))
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        apart = ((at["l_ankle"] - at["r_ankle"]) * forward).sum(axis=-1) / norm / leg
        straighter = np.fmin(*(_flexion(at, side) for side in "rl"))
    known = np.isfinite(apart)
    apart, time_s, straighter = apart[known], time_s[known], straighter[known]
    sides = np.sign(apart) * (np.abs(apart) > _STEP / 2)
    rows = np.flatnonzero(sides)
    turns = np.flatnonzero(np.diff(sides[rows]))
    if len(turns) < _FEWEST:
        return None
    spans = [slice(rows[turn], rows[turn + 1] + 1) for turn in turns]
    passes = np.array([span.start + int(np.abs(apart[span]).argmin()) for span in spans])
    gaps = np.diff(time_s[passes])
    early, late = np.percentile(gaps, [25, 75])
    if not late < _REGULAR * early:
        return None
    reach = np.array([np.abs(apart[a : b + 1]).max() for a, b in pairwise(passes)])
    even = late < _EVEN * early and reach.std() < _ALIKE * reach.mean()
    return _Gait(
        float(np.median(gaps)), float(np.median(reach)), bool(even), float(np.median(straighter[passes]))
    )


def _flexion(at: dict[str, np.ndarray], side: str) -> np.ndarray:
    """(T,) of a knee, in degrees."""
    thigh, shank = at[f"{side}_knee"] - at[f"{side}_hip"], at[f"{side}_ankle"] - at[f"{side}_knee"]
    return angle_deg(thigh, shank)
