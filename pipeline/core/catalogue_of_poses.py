"""The notices of the catalogue that say what is wrong with poses, or that nothing is."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .catalogue import About, Weight

JUDGING: dict[str, tuple[Weight, About, str]] = {
    # What is wrong with poses
    "too-few-frames": ("suspicious", "poses",
        "Fewer than two frames have all joints: too few to tell whether the poses are good."),
    "gaps": ("note", "poses",
        "{lost} of {frames:~frame} {lost:?is/are} missing: {how}."),
    "duplicates": ("note", "poses",
        "{repeated:~row repeats/rows repeat} the row before exactly, first at row {first}; speeds are wrong there."),
    "frames-not-numbered": ("note", "poses",
        "The file does not say which video frames its rows belong to."),
    "rate-not-stated": ("note", "poses",
        "The file does not say its frame rate."),
    "swaps": ("note", "poses",
        "{wrong} of {of:~frame} {wrong:?looks/look} wrong: {swaps}."),
    "swaps-unsure": ("note", "poses",
        "Some frames look wrong: {doubt}."),
    "rebase": ("suspicious", "poses",
        "In every frame the outermost joint lies exactly at {axis} = 0: the pelvis's movement along that axis is "
        "lost."),
    "flat": ("unusable", "poses",
        "All joints lie in one plane (thickness {thickness_percent:.1f} % of the trunk): the poses have no depth."),
    "axis-invented": ("unusable", "poses",
        "Nothing moves along {axis} while the body moves along the other axes: that axis is invented."),
    "flattened-depth": ("suspicious", "poses",
        "Bones get shorter when they turn towards the camera, as if depth were {factor:.1f} times too small."),
    "depth-stretched": ("suspicious", "poses",
        "Bones get longer when they turn towards the camera, as if depth were {times:.1f} times too large."),
    "limbs-copied": ("suspicious", "poses",
        "One {limb} is a copy of the other, so left and right cannot be told apart."),
    "repeats-itself": ("suspicious", "poses",
        "{count} of {rows_read:~row} are exact repeats: the clip plays more than once, so counts and cadences are "
        "wrong."),
    "only-noise": ("suspicious", "poses",
        "Hands and feet only jump back and forth: this is noise, a single pose, or rows in the wrong order."),
    "keypoints-smooth": ("warning", "files",
        "The keypoints of hands and feet tremble by only {trembles_percent:.2g} % of the trunk; a detector's tremble "
        "by 4 % and more. They were smoothed or computed: give the detector's own."),
    "joints-filled": ("warning", "files",
        "{count:~joint position} {count:?lies/lie} exactly on straight lines in time, or {count:?repeats/repeat} the "
        "one before ({joints}): filled in, not seen. They are treated as gaps."),
    "joints-coincide": ("suspicious", "poses",
        "The {first} and the {second} lie at one point in {count:~frame}: one of them was not found there. They are "
        "treated as gaps, joints of the trunk excepted."),
    "joints-exchanged": ("suspicious", "left and right",
        "Bones are longer than crosswise: left and right {joints} are exchanged. They are treated as gaps."),
    "bones": ("suspicious", "poses",
        "Bone lengths vary by {spread_percent:.0f} % (5 % is usual, 9 % poor), most from {worst} "
        "({worst_percent:.0f} %)."),
    "limbs-unlike": ("suspicious", "poses",
        "The bone from {bone} is {times:.2f} times as long as the left one."),
    "mirrored": ("unusable", "poses",
        "The body is mirrored or its left and right are exchanged (--set read.handedness=mirror or swap): {evidence}."),
    "legs-against-arms": ("unusable", "poses",
        "Left and right of the legs contradict those of the arms (--set read.handedness=swap-legs): {evidence}."),
    "left-and-right": ("suspicious", "poses",
        "Left and right are doubtful: {evidence}."),
    "stature": ("suspicious", "poses",
        "The limbs imply a stature of {stature_m:.3g} m. Check that the unit of the file is really {unit}."),
    "upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: the file's vertical axis seems to be "
        "upside down, or the person does a handstand. If its y points up, read it with --adapter arrays -O "
        "frame=GL_CAMERA (or Y_UP) and its layout and unit, such as -O layout=H36M17 -O unit=mm (-O unit=arbitrary "
        "if it has no scale)."),
    "on-its-side": ("suspicious", "poses",
        "The trunk is tilted by more than {off_deg:.0f} degrees from the file's vertical axis in {share_percent:.0f} % "
        "of the frames: the person lies or crawls, or another axis is up. In that case say which (-O up=y or z; with "
        "--adapter arrays -O frame=Y_UP or Z_UP)."),
    "picture-upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: turn the image before the run, unless "
        "the person does a handstand."),
    "leaps": ("suspicious", "poses",
        "The whole pose leaps from one frame to the next in {count:~frame}, first in frame {first}."),
    "seams": ("note", "poses",
        "The estimator started a new clip at row {listed}."),
    "seams-step": ("note", "poses",
        "The estimator started a new clip at row {listed}; the pose jumps there by up to {times:.1f} times its usual "
        "movement."),
    "refused": ("unusable", "poses",
        "{reason}"),
    "video-apart": ("suspicious", "poses",
        "The poses reach frame {last}, but the video ends with frame {ends}: they do not belong together."),
    "video-unnumbered": ("suspicious", "poses",
        "There are {rows_read:~row} without frame numbers for {frames:~frame} of the video: time may drift."),
    "video-fits": ("note", "poses",
        "There are {rows_read:~row} for {frames:~frame} of the video, at {fps:g} per second."),
    "keypoints-not-compared": ("note", "poses",
        "The poses were not compared with the keypoints: {reason}."),
    "keypoints-met": ("note", "poses",
        "The poses fit the keypoints within {off_percent:.1f} % of the stature, in the {frames:~frame} that were "
        "compared."),
}  # fmt: skip
