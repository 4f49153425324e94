"""The notices of the catalogue that compare a run with another, with motion capture or with inertial sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .catalogue import About, Weight

_APART = "taken for different motions, so only their ranges and cycles are compared."
_ONE = "are they of one motion, and is the shift right?"
_FITS = (
    "Another shift of {run} fits about as well (r {runner_up:.2f} against {r:.2f}), as it does where a motion repeats "
    "itself, in two takes of walking too"
)
_NARROW = "narrow it with --offset and --search"

COMPARING: dict[str, tuple[Weight, About, str]] = {
    # Comparing runs
    "run-not-levelled": ("warning", "up",
        "{run} could not be levelled: angles to gravity are missing."),
    "run-of-moving-camera": ("warning", "camera",
        "{run} was seen by a moving camera: its heading is relative to that."),
    "run-lacks-angles": ("warning", "files",
        "{run} has no {angles}: only the other angles are compared; run it again to have all."),
    "truth-lacks-joints": ("note", "files",
        "The motion capture has no {joints}; the rest is compared. Angles left out: {angles}."),
    "truth-trunk-by-shoulders": ("note", "files",
        "The motion capture has no thorax: in both, the trunk line goes from the middle of the hips to the middle of "
        "the shoulders."),
    "neutral-of-some": ("warning", "motion",
        "The angles of {with_neutral} are from a neutral posture (--neutral), those of {without} are not: they differ "
        "by that posture throughout."),
    "cutoffs-differ": ("warning", "motion",
        "The runs were low-passed at different cut-offs ({cutoffs} Hz)."),
    "rates-differ": ("warning", "clock",
        "The {takes} were lifted at {least_fps:.4g} to {most_fps:.4g} frames a second, which alone changes ranges of "
        "motion (of the knee in walking by 3 degrees from 30 to 60): film what is to be compared at one rate."),
    "told-apart": ("warning", "motion",
        f"{{run}} and {{other}} have different {{what}}: {_APART} --align correlate if not."),
    "no-common-time": ("warning", "clock",
        "{run} and {other} share no second by their clocks, within {search_s:g} s (--search) of {offset_s:g} s "
            f"(--offset): {_APART}"),
    "angles-apart": ("warning", "motion",
        f"The angles of {{run}} and {{other}} correlate weakly (r {{r:.2f}}): {_APART}"),
    "angles-weak": ("warning", "motion",
        f"The angles of {{run}} and {{other}} correlate weakly (r {{r:.2f}}): {_ONE}"),
    "angles-unusual": ("warning", "motion",
        "The angles of {run} and {other} correlate less (r {r:.2f}) than those of one motion mostly do (r {usual:g} "
            f"and more): {_ONE}"),
    "shift-unknown": ("warning", "clock",
        f"{_FITS}: {_APART} If they are one, {_NARROW}, or give --align stamps where both began together."),
    "shift-ambiguous": ("warning", "clock",
        f"{_FITS}; the one nearest to {{offset_s:g}} s (--offset) is taken: {_NARROW}."),
    "partly-common": ("warning", "motion",
        "{run} and {other} have {common_s:.1f} of {longest_s:.1f} s in common: their ranges of motion, counts and "
        "figures of movements are each of its whole take, and may differ for that alone; run both on the common part "
        "(--time-range)."),
    # Comparing with inertial sensors
    "imu-unit": ("repair", "files",
        "Accelerations were in {unit} (gravity is {gravity:.3g} in them) and are converted to m/s^2."),
    "imu-run-not-levelled": ("warning", "up",
        "The run could not be levelled, so its axes are not upright."),
    "imu-moving-camera": ("warning", "camera",
        "The camera moves: only the vertical axis can be compared, the others turn with the camera."),
    "imu-scale-fitted": ("warning", "",
        "The run has no scale; its unit is taken for {metres:.3g} m, which fits the IMU best."),
    "imu-weak": ("warning", "clock",
        "Video and IMU agree weakly (r {r:.2f} over all axes); lag and heading may be wrong. Is the sensor on that "
        "segment and side, of this take, and within the search?"),
    "imu-lag-ambiguous": ("warning", "clock",
        "Another lag fits nearly as well (r {runner_up:.2f} against {r:.2f}), as in a periodic motion; narrow it with "
        "--offset and --search."),
    "imu-clock-differs": ("warning", "clock",
        "The IMU's clock is {way}: {rate:.5f} of its seconds pass in one of the video's; it is brought to the video's "
        "rate."),
}  # fmt: skip
