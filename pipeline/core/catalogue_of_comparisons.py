"""The notices of the catalogue that compare a run with another, with motion capture or with inertial sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .catalogue import About, Weight

_APART = "They are treated as different motions, so only their ranges and cycles are compared."
_ONE = "Check that they show the same motion, and that the time shift is right."
_FITS = "{run} fits at several shifts (r {r:.2f} and, at another, {runner_up:.2f}), as in a repeated motion."
_NARROW = "narrow the search with --offset and --search"

COMPARING: dict[str, tuple[Weight, About, str]] = {
    # Comparing runs
    "run-doubtful": ("warning", "files",
        "The poses of {run} are {verdict}, so differences may be their errors: {why}."),
    "run-not-levelled": ("warning", "up",
        "{run} could not be levelled, so angles to gravity are missing."),
    "run-of-moving-camera": ("warning", "camera",
        "{run} was filmed by a moving camera, so its heading is relative to the camera."),
    "run-lacks-angles": ("warning", "files",
        "{run} has no {angles}. Run it again to compare all angles."),
    "truth-lacks-joints": ("note", "files",
        "The motion capture has no {joints}, so these angles are left out: {angles}."),
    "truth-trunk-by-shoulders": ("note", "files",
        "The motion capture has no thorax, so for both the trunk line goes from the middle of the hips to the middle "
        "of the shoulders."),
    "neutral-of-some": ("warning", "motion",
        "The angles of {with_neutral} are relative to a neutral posture (--neutral), those of {without} are not, so "
        "they differ by that posture."),
    "cutoffs-differ": ("warning", "motion",
        "The runs were filtered at different cut-offs ({cutoffs})."),
    "rates-differ": ("warning", "clock",
        "The {takes} were lifted at {least_fps:.4g} to {most_fps:.4g} frames per second. This alone changes ranges "
        "of motion (in walking, the knee's by 3 degrees between 30 and 60): film at one rate."),
    "told-apart": ("warning", "motion",
        f"{{run}} and {{other}} have different {{what}}. {_APART} If they are the same motion, give "
        "--align correlate."),
    "no-common-time": ("warning", "clock",
        "By their clocks {run} and {other} do not overlap in time, within {search_s:g} s (--search) of {offset_s:g} "
        f"s (--offset). {_APART}"),
    "angles-apart": ("warning", "motion",
        f"The angles of {{run}} and {{other}} correlate weakly (r {{r:.2f}}). {_APART} If they are the same motion, "
        "give --align correlate."),
    "angles-weak": ("warning", "motion",
        f"The angles of {{run}} and {{other}} correlate weakly (r {{r:.2f}}). {_ONE}"),
    "angles-unusual": ("warning", "motion",
        "The angles of {run} and {other} correlate less (r {r:.2f}) than those of one motion usually do (r "
        f"{{usual:g}} or more). {_ONE}"),
    "mirror-images": ("warning", "motion",
        "{run} fits {other} better with left and right exchanged (r {of_image:.2f} against {r:.2f}): the video of one "
        "of them is mirrored, the shift is off by half a stride, or the other side moved."),
    "shift-unknown": ("warning", "clock",
        f"{_FITS} {_APART} If they are the same motion, {_NARROW}, or give --align stamps if both began together."),
    "shift-ambiguous": ("warning", "clock",
        f"{_FITS} The shift nearest to {{offset_s:g}} s (--offset) was used: {_NARROW}."),
    "partly-common": ("warning", "motion",
        "{run} and {other} have only {common_s:.1f} of {longest_s:.1f} s in common, but their figures are of the "
        "whole takes. Run both on the common part (--time-range)."),
    # Comparing with inertial sensors
    "imu-unit": ("repair", "files",
        "Accelerations were in {unit} (gravity is {gravity:.3g} in that unit) and were converted to m/s^2."),
    "imu-run-not-levelled": ("warning", "up",
        "The run could not be levelled, so its axes are not upright."),
    "imu-moving-camera": ("warning", "camera",
        "The camera moves, so only the vertical axis can be compared."),
    "imu-scale-fitted": ("warning", "",
        "The run has no scale; its unit was taken to be {metres:.3g} m, which fits the sensor best."),
    "imu-weak": ("warning", "clock",
        "Video and sensor agree weakly (r {r:.2f} over all axes), so lag and heading may be wrong. Check the "
        "sensor's segment, side and take, and the search range."),
    "imu-lag-ambiguous": ("warning", "clock",
        f"Another lag fits nearly as well (r {{runner_up:.2f}} against {{r:.2f}}), as in a periodic "
        f"motion; {_NARROW}."),
}  # fmt: skip
