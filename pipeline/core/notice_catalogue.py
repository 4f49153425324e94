"""Every notice of pcnet3d: its code, how grave it is, what it is about, and its sentence."""

from __future__ import annotations

from typing import Literal, NamedTuple

# From the least to the gravest; a mark is a place in the recording. The last two are verdicts on poses.
Weight = Literal["mark", "note", "repair", "warning", "suspicious", "unusable"]
About = Literal["", "poses", "left and right", "view", "up", "camera", "clock", "place", "motion", "files"]


class Entry(NamedTuple):
    """weight: unless the one who says it weighs it. template: of the sentence, with its values (core/notices.py)."""

    weight: Weight
    about: About
    template: str


_ENTRIES: dict[str, tuple[Weight, About, str]] = {
    # What was read
    "part-only": ("note", "files",
        "{part}; the whole recording has {whole}."),
    "frames-as-gaps": ("repair", "files",
        "Treated as gaps: {counts}."),
    "interlaced": ("warning", "view",
        "The video is interlaced: each image mixes two moments, so moving edges look like combs. Joints are more "
        "certain in whole images: ffmpeg -i IN -vf bwdif OUT."),
    "video-damaged": ("warning", "files",
        "{damage}. Copy the video again, or leave that part out (--time-range)."),
    "images-repeated": ("warning", "clock",
        "Of {of:~image} with movement, {repeated} only {repeated:?repeats/repeat} the one before, {where}. Up to four "
        "in a row are interpolated; speeds are less certain. Record or export the video at the camera's own frame "
        "rate."),
    "images-frozen": ("warning", "view",
        "The image stands still in frames {frames}. Where the person is meanwhile is not known, so nothing is measured "
        "there."),
    "scene-changes": ("warning", "files",
        "The video is cut {count:~time}, at frame {frames}: another scene begins, images were taken out, or "
        "the picture was enlarged. People are not tracked across a cut, and share no LEVEL axes."),
    "people-by-poses-alone": ("warning", "files",
        "The file has no track numbers and no boxes, so people were told apart by their poses. Check that each is "
        "only one person."),
    "keypoints-not-of-poses": ("suspicious", "files",
        "The poses differ from the keypoints by {off_percent:.1f} % of the stature{how}. They are of different people, "
        "recordings or frames, or the poses were changed."),
    "leap-between-people": ("warning", "files",
        "The person leaps by {sizes:.1f} body sizes at frame {frame}{unseen}: it may be another person from "
        "then on, or frames are missing."),
    "clock-not-used": ("warning", "clock",
        "'{column}' increases from row to row like a clock or a frame number, but was not used. If it is one, rename "
        "it frame_index, time_s or time_ms."),
    "array-judged": ("note", "files",
        "The file does not say what its array holds. It was read as Human3.6M's joints in camera axes (x right, y "
        "down, z away), in {unit}, because left and right, bone lengths and heights agree with that."),
    "order-by-bones": ("warning", "files",
        "The file does not say in which order its joints are. They were read as {order}, because their limbs are those "
        "of a body in that order only. If that is wrong: --set keypoints.layout={usual}."),
    "scores-all-zero": ("warning", "files",
        "All scores of the keypoints are 0, so they say nothing: a joint that the detector guessed counts as seen."),
    "no-joint-centres": ("warning", "files",
        "People left out, because their points are not joint centres: {people}."),
    "no-track-number": ("warning", "files",
        "{unnamed:~detection} of {detections} {unnamed:?has/have} no track number and {unnamed:?was/were} left "
        "out. --set keypoints.track=true joins each person to the nearest one before."),
    "rebased-to-floor": ("warning", "files",
        "In {rebased} of {frames:~frame} the lowest joint was put at height 0. It changed {changes:~time}, so the "
        "body's vertical movement is lost. Run MMPose with --disable-rebase-keypoint."),
    "figures-withheld": ("warning", "poses",
        "The poses are unusable, so no ranges and movements were computed; --set measures.unusable=true computes "
        "them."),
    # The clock
    "slow-motion-stated": ("warning", "clock",
        "The video was captured at {captured_fps:g} frames per second and plays at {shown_fps:.4g}, but "
        "{used_fps:.4g} was used: durations are {times:.3g} times too long. Give --fps {captured_fps:g}."),
    "fps-contradicts": ("warning", "clock",
        "--fps {used_fps:g} was used, but the {source} says {shown_fps:g} frames per second. If that is right, "
        "leave --fps out: speeds are {times:.3g} times what they should be."),
    "clocks-contradict": ("warning", "clock",
        "The video's {shown_fps:.4g} frames per second were used, but the file's own times say {stated_fps:.4g}. "
        "If the file is right, give --fps {stated_fps:.4g}: speeds are {times:.3g} times what they should be."),
    "rate-against-movement": ("warning", "clock",
        "At {fps:.4g} frames per second {movement}, {times:.2g} times too {way}. If the rate is wrong, give the "
        "camera's (--fps); about {fits:.2g} would fit."),
    "rows-lost": ("suspicious", "clock",
        "At {count:~row} the whole body moves further than in one frame, {how}. Write the file with frame numbers or "
        "times, or give run --fps."),
    "rows-added": ("suspicious", "clock",
        "{count} of {of:~row} {count:?lies/lie} exactly midway between the rows beside {count:?it/them}: a program put "
        "{count:?it/them} there. Give the file as it was made, or the rate of its rows (run --fps)."),
    # Keypoints and video
    "keypoints-not-of-video": ("suspicious", "files",
        "The keypoints do not move like the image beneath them (agreement {alike:.2f} of 1; 0.45 or more is "
        "usual){how}. Give the keypoints of this video, numbered by its frames."),
    # Detecting
    "others-missed": ("note", "files",
        "The detector follows one person at a time; --everyone finds and processes everybody."),
    "person-chosen": ("warning", "files",
        "Person {person} was processed; left out {others:?is/are} {listed}: {others:?another person/other people}, or "
        "the same one under another number. --everyone processes all, --person NAME another."),
    "cut-or-another": ("warning", "view",
        "At frame {frame} one person is lost and another found: it may be the same person under another number."),
    "joined-again": ("note", "files",
        "Person {person} was out of view and came back as {again}: taken for the same by place, size and look."),
    "hardly-a-person": ("warning", "view",
        "Person {person} may not be a person: {reason}. Look at the pictures of the report."),
    "interrupted": ("warning", "files",
        "Interrupted at frame {frame} of {frames}; --resume continues from there."),
    # The camera
    "camera-moves": ("note", "camera",
        "The camera {how}: the background moves by {percent_a_second:.0f} % of the image per second. If it neither "
        "moves nor zooms, give --camera static."),
    "camera-shakes": ("note", "camera",
        "The camera shakes: the image wanders by {reach_percent:.0f} % of its longer side. Places and up are that much "
        "less certain."),
    "camera-against-told": ("warning", "camera",
        "You gave --camera {told}, but {found}. If that is so, give --camera {other}."),
    "camera-motion-unknown": ("note", "camera",
        "It is unclear whether the camera moves: the background has too few corners, or each moves in its own way."),
    "focal-against-lines": ("warning", "camera",
        "You gave a focal length of {focal_px:.0f} pixels, but according to {by} it is about {fits:.0f}. If they are "
        "right, place and speed are wrong. Your value is used (--focal)."),
    # Left and right
    "sides-put-right": ("repair", "left and right",
        "Left and right were corrected as asked: {repair}."),
    "sides-wrong-as-asked": ("warning", "left and right",
        "Left and right were treated as you asked, but then they are {verdict}: {evidence}."),
    "swaps-found": ("warning", "left and right",
        "The {what} look wrong: {swaps} ({wrong} of {of:~frame}); run --set read.swaps=mask leaves these "
        "limbs out there."),
    "swaps-doubtful": ("warning", "left and right",
        "The {what} look wrong: {doubt}, or in the frames before or after these."),
    "swaps-masked": ("repair", "left and right",
        "The {what} were masked as asked: {swaps} ({wrong} of {of:~frame})."),
    "swapped-keypoints": ("warning", "left and right",
        "If the poses were lifted from these keypoints, {wrong:~pose is/poses are} wrong. Correct the keypoints "
        "and lift them again, or give --set read.swaps=mask."),
    "swapped-to-keypoints": ("warning", "left and right",
        "From {when} poses and keypoints disagree on which of the {limbs} is the right one; one of the two is wrong."),
    # Lifting
    "focal-guessed": ("note", "camera",
        "The focal length was assumed to be {focal_px:.0f} pixels, and the video to be uncropped: place and "
        "speed are less sure. Give --focal PIXELS."),
    "frames-without-joints": ("warning", "",
        "{frames:~frame was/frames were} not lifted, because {reason}."),
    # Cleaning, scaling, placing
    "seam": ("mark", "",
        "The estimator started a new clip {where}."),
    "rows-inserted": ("repair", "",
        "{count:~frame} that the estimator dropped {count:?was/were} put back as gaps."),
    "spikes-removed": ("repair", "",
        "{count:~single-frame jump} of a joint {count:?was/were} removed."),
    "strays-removed": ("repair", "",
        "{count:~frame} {count:?was/were} removed, because the whole pose leaps before and after."),
    "gaps-filled": ("repair", "",
        "{count:~missing joint position} in gaps of up to {max_gap_s} s {count:?was/were} interpolated."),
    "images-lacking": ("repair", "view",
        "The video has no images {when}; {so}."),
    "joints-absent": ("note", "",
        "The file has no {joints}; what needs {count:?it/them} is left out."),
    "image-size-doubtful": ("warning", "view",
        "{share_percent:.0f} % of the 2D keypoints lie far outside an image of {width} x {height} pixels, up to x = "
        "{right:.0f} and y = {down:.0f}. Give the size of the image of the keypoints (--set read.image_size); "
        "otherwise the place is wrong."),
    "not-seen": ("warning", "view",
        "The {part} {parts:?is/are} {how} {when}; results that need {parts:?it/them} are missing there."),
    "no-scale": ("note", "",
        "{lengths}. Give the person's height (--stature METRES) for lengths in metres."),
    "not-placed": ("note", "place",
        "It is not known where the person is: {reason}."),
    "placed": ("note", "place",
        "The path of the pelvis comes from the keypoints, in {placed} of {frames} frames{bridges}. Each frame is "
        "within {within:g} {unit}, mostly in depth; besides, the size of the whole path is within {size_percent:g} %; "
        "{depth}{guess}{unjudged}."),
    # Up
    "not-levelled": ("warning", "up",
        "The take could not be levelled: {reason}."),
    "nobody-upright": ("suspicious", "up",
        "The trunk is tilted by more than {off_deg:.0f} degrees in {share_percent:.0f} % of the frames: the person "
        "lies or bends down, or the image is turned. In that case turn the video."),
    "image-against-bodies": ("warning", "up",
        "The image's lines and the body disagree about up by {apart_deg:.0f} degrees: {answers}. The "
        "{believed} believed{so}. To use the other answer: --set read.pitch={pitch:.0f} --set read.roll={roll:.0f}."),
    "told-up-contradicted": ("warning", "up",
        "The gravity that you gave and {other} differ by {apart_deg:.0f} degrees, more than their errors explain; "
        "your value is used."),
    # Motion and angles
    "relative-to-camera": ("note", "motion",
        "The camera moves, so x and y are relative to it. Heights (z, vz, az) and distances are right; other speeds "
        "and accelerations include the camera's rotation."),
    "errors-unknown": ("note", "motion",
        "The errors of {what} are not known: {reason}."),
    "on-a-belt": ("note", "motion",
        "The standing feet are carried back under the body, as on a treadmill: speed and lengths of steps are "
        "relative to its belt."),
    "gait-unlike-any-seen": ("warning", "motion",
        "The gait errors were fitted on people whose {gait} had no such values: {figures}. There they were not "
        "compared with ground truth."),
    "not-filtered": ("warning", "motion",
        "{fps:.4g} frames per second are too few for a filter at {cutoff_hz:g} Hz, so the joints are not filtered."),
    "pieces-too-short": ("warning", "motion",
        "{values:~joint position was/joint positions were} seen for too short a time between gaps to be smoothed at "
        "{cutoff_hz:g} Hz; {values:?its/their} {missing} are missing."),
    "angles-left-out": ("note", "motion",
        "Angles left out (in brackets: frames): {angles}. Reason: {reason}."),
    # Files that were written
    "not-written": ("warning", "files",
        "{file} was not written, because {reason}."),
    "file-begins": ("note", "files",
        "{file} begins at {begin_s:.3f} s of the take."),
    "animation-held": ("note", "files",
        "{file}: in {held} of {frames:~frame} nothing is known about {joints}; the last known value is kept."),
    "axial-guessed": ("note", "files",
        "{file}: how bones turn about their own length is guessed while a limb is straight (legs in {legs:.0f} %, arms "
        "in {arms:.0f} % of the frames), and always for shoulders, neck and head."),
    # What is wrong with poses
    "too-few-frames": ("suspicious", "poses",
        "Fewer than two frames have all joints: too few to tell whether the poses are good."),
    "gaps": ("note", "poses",
        "{lost} of {frames:~frame} {lost:?is/are} missing: {how}."),
    "duplicates": ("note", "poses",
        "{repeated:~row repeats/rows repeat} the row before exactly, first at row {first}; speeds are wrong there."),
    "not-stated": ("note", "poses",
        "The file does not say {what}."),
    "poses-far-off": ("suspicious", "poses",
        "The joints are probably off by {mm:.0f} mm on average, and may be off by twice that: look at them beside the "
        "images before you use a figure."),
    "flat": ("unusable", "poses",
        "All joints lie in one plane (thickness {thickness_percent:.1f} % of the trunk): the poses have no depth."),
    "axis-invented": ("unusable", "poses",
        "Nothing moves along {axis} while the body moves along the other axes: that axis is invented."),
    "depth-scaled": ("suspicious", "poses",
        "Bones get {way} when they turn towards the camera, as if depth were {times:.1f} times too {size}."),
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
        "Bones would be shorter, and keep their lengths better, with the {first} and the {second} in each other's "
        "place: their names are exchanged. They are treated as gaps, joints of the trunk excepted."),
    "bones": ("suspicious", "poses",
        "Bone lengths vary by {spread_percent:.0f} % (5 % is usual, 9 % poor), most from {worst} "
        "({worst_percent:.0f} %)."),
    "mirrored": ("unusable", "poses",
        "The body is mirrored or its left and right are exchanged (run --set read.handedness=mirror or swap): "
        "{evidence}."),
    "legs-against-arms": ("unusable", "poses",
        "Left and right of the legs contradict those of the arms (run --set read.handedness=swap-legs): {evidence}."),
    "left-and-right": ("suspicious", "poses",
        "Left and right are doubtful: {evidence}."),
    "image-stretched": ("suspicious", "poses",
        "The keypoints fit a body better if the image is made {times:.3g} times narrower: it may have been stretched. "
        "Detect in the image as it was filmed."),
    "poses-smooth": ("suspicious", "poses",
        "Limbs are shorter the faster they turn, as where joints were averaged over {window_s:.1f} s: quick movements "
        "are too small. Give the poses as they were before."),
    "stature": ("suspicious", "poses",
        "The limbs imply a stature of {stature_m:.3g} m. Check that the unit of the file is really {unit}."),
    "upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: {what}, unless the person does a "
        "handstand."),
    "on-its-side": ("suspicious", "poses",
        "The trunk is tilted by more than {off_deg:.0f} degrees from the file's vertical axis in {share_percent:.0f} % "
        "of the frames: the person lies or crawls, or another axis is up. In that case say which (-O up=y or z; with "
        "--adapter arrays -O frame=Y_UP or Z_UP)."),
    "leaps": ("suspicious", "poses",
        "The whole pose leaps from one frame to the next in {count:~frame}, first in frame {first}."),
    "refused": ("unusable", "poses",
        "{reason}"),
    # Comparing runs
    "run-doubtful": ("warning", "files",
        "The poses of {run} are {verdict}, so differences may be their errors: {why}."),
    "run-not-levelled": ("warning", "up",
        "{run} could not be levelled, so angles to gravity are missing."),
    "run-of-moving-camera": ("warning", "camera",
        "{run} was filmed by a moving camera, so only the vertical axis is sure; its heading is relative to "
        "the camera."),
    "truth-lacks-joints": ("note", "files",
        "The motion capture has no {joints}, so these angles are left out: {angles}.{trunk}"),
    "cutoffs-differ": ("warning", "motion",
        "The runs were filtered at different cut-offs ({cutoffs})."),
    "rates-differ": ("warning", "clock",
        "The runs were lifted at {least_fps:.4g} to {most_fps:.4g} frames per second. This alone changes ranges "
        "of motion (in walking, the knee's by 3 degrees between 30 and 60): film at one rate."),
    "angles-weak": ("warning", "motion",
        "The angles of {run} and {other} correlate weakly (r {r:.2f}; 0.75 and more is usual). Check that they show "
        "the same motion, and that the time shift is right."),
    "shift-ambiguous": ("warning", "clock",
        "{run} fits at several shifts (r {r:.2f} and, at another, {runner_up:.2f}), as in a repeated motion. "
        "{so}"),
    "partly-common": ("warning", "motion",
        "{run} and {other} have only {common_s:.1f} of {longest_s:.1f} s in common, but their figures are of the "
        "whole takes. Run both on the common part (run --time-range)."),
    # Comparing with inertial sensors
    "imu-unit": ("repair", "files",
        "Accelerations were in {unit} (gravity is {gravity:.3g} in that unit) and were converted to m/s^2."),
    "imu-scale-fitted": ("warning", "",
        "The run has no scale; its unit was taken to be {metres:.3g} m, which fits the sensor best."),
    "imu-weak": ("warning", "clock",
        "Video and sensor agree weakly (r {r:.2f} over all axes), so lag and heading may be wrong. Check the "
        "sensor's segment, side and take, and the search range."),
}  # fmt: skip
CATALOGUE = {code: Entry(*entry) for code, entry in _ENTRIES.items()}
