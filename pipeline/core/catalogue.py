"""Every notice of pcnet3d: its code, how grave it is, what it is about, and its sentence."""

from __future__ import annotations

from typing import Literal, NamedTuple

from .catalogue_of_comparisons import COMPARING

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
        "Only {part} was processed, as asked; the whole recording is from {whole}."),
    "part-covered": ("note", "files",
        "The data cover video frames {first} to {last} of {frames}."),
    "frames-unknown": ("warning", "files",
        "The file does not say which video frames its rows belong to; they are counted from 0."),
    "gaps-as-asked": ("repair", "files",
        "Treated as gaps, as asked: {counts}."),
    "video-cut-off": ("warning", "files",
        "The images of {file} end after {ends_s:.1f} s of {stated_s:.1f} s. It may be cut off or damaged: copy it "
        "again."),
    "video-damaged": ("warning", "files",
        "The video is damaged at frame {frames}, up to the next key frame. Copy it again, or leave that part out "
        "(--time-range)."),
    "scene-changes": ("warning", "files",
        "The video cuts to another scene {count:~time}, at frame {frames}; nobody is followed across a cut."),
    "scenes-apart": ("note", "files",
        "People share the camera and the LEVEL axes only within one scene of the video."),
    "people-by-poses-alone": ("warning", "files",
        "The file has no track numbers and no boxes, so people were told apart by their poses. Check that each is "
        "one person throughout."),
    "keypoints-of-somebody-else": ("suspicious", "files",
        "Person '{person}' of the poses differs from '{track}' of the keypoints by {apart:.2f} of their spread; "
        "one person has {most:g} at most. Give the keypoints of this person and of these frames; else the path is "
        "wrong."),
    "keypoints-not-of-poses": ("suspicious", "files",
        "The poses are off the keypoints by {off_percent:.1f} % of the stature{how}. They belong to different "
        "recordings or frames, or the poses were changed."),
    "leap-between-people": ("warning", "files",
        "The person leaps by {sizes:.1f} body sizes at frame {frame}: it may be another person from there on."),
    "leap-after-gap": ("warning", "files",
        "The person leaps by {sizes:.1f} body sizes at frame {frame}, unseen for {unseen:~frame} before: it may be"
        " another person from there on."),
    "no-joint-centres": ("warning", "files",
        "Left out, because the points are not joint centres: {people}."),
    "no-track-number": ("warning", "files",
        "{unnamed:~detection} of {detections} {unnamed:?has/have} no track number and {unnamed:?was/were} left "
        "out. --set keypoints.track=true joins each person to the nearest one before."),
    "rebased-to-floor": ("warning", "files",
        "In {rebased} of {frames:~frame} the lowest joint was put at height 0, and it was another joint "
        "{changes:~time}, so the body's rise and fall is lost. Run MMPose with --disable-rebase-keypoint."),
    "display-undone": ("warning", "files",
        "A rotation for display was undone, as asked, taken to be that of Human3.6M's camera 54138969; with "
        "another one the body is tilted."),
    "stature-assumed": ("warning", "files",
        "RTMW3D's file has no scale across the image; a stature of {stature_m:g} m was assumed."),
    "figures-withheld": ("warning", "poses",
        "The poses are unusable, so no figures were computed; --set measures.unusable=true computes them."),
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
    "falls-slowly": ("warning", "clock",
        "In {flights:~flight} the body falls at {share:.2g} of gravity, as in slow motion by {times:.2g} times. If"
        " the camera captured about {fps:g} frames per second, give --fps {fps:g}."),
    "falls-fast": ("warning", "clock",
        "In {flights:~flight} the body falls at {share:.2g} of gravity, as in a time lapse by {times:.2g} times. "
        "If the camera captured about {fps:g} frames per second, give --fps {fps:g}."),
    "moves-slowly": ("warning", "clock",
        "At {fps:.4g} frames per second {found}, slower than people usually move. For slow motion give the "
        "camera's rate (--fps)."),
    "moves-fast": ("warning", "clock",
        "At {fps:.4g} frames per second {found}, faster than people can move. If the rate is wrong, give the "
        "camera's (--fps)."),
    "gait-against-rate": ("suspicious", "clock",
        "At {fps:.4g} frames per second the legs {gait}, and pass each other every {step_s:.2f} s: {times:.1f} "
        "times too {way}. Give the camera's rate (--fps), about {fits:.2g} by the gait."),
    "movement-against-rate": ("suspicious", "clock",
        "At {fps:.4g} frames per second the body moves about {times:.1f} times too {way} for people. Give the "
        "camera's rate (--fps), about {fits:.2g} by the movement."),
    "played-backwards": ("suspicious", "clock",
        "The body moves as in a clip that is played backwards. Sort the frames, unless the person moves backwards."),
    "rows-lost": ("suspicious", "clock",
        "At {count:~row} the whole body moves by more than one frame's movement, {how}. Write the file with frame "
        "numbers or times, or give --fps."),
    # Keypoints and video
    "video-not-compared": ("note", "files",
        "It cannot be told whether the keypoints belong to this video: {reason}."),
    "keypoints-move-as-video": ("note", "files",
        "The keypoints move like the image beneath them (agreement {alike:.2f})."),
    "keypoints-not-of-video": ("suspicious", "files",
        "The keypoints do not move like the image beneath them (agreement {alike:.2f}; 0.45 or more is "
        "usual){how}. Give the keypoints of this video, numbered by its frames."),
    # Detecting
    "detected": ("note", "files",
        "The 2D keypoints were detected in the video by {detector}."),
    "person-chosen": ("note", "files",
        "People were followed under {people:~number} (frames in brackets): {listed}{unsure}. Number {person} was "
        "taken, in frames {first} to {last}; --person chooses another."),
    "hardly-a-person": ("warning", "view",
        "Person {person} may be no person: shoulders and hips score {score:.2f} (people have 0.6 or more). Look at"
        " the key frames."),
    "interrupted": ("warning", "files",
        "Interrupted at frame {frame} of {frames}; --resume continues from there."),
    # The camera
    "camera-moves": ("note", "camera",
        "The camera {how}: the background moves by {percent_a_second:.0f} % of the image per second. If it stands "
        "still, give --camera static."),
    "camera-moves-against-told": ("warning", "camera",
        "You gave --camera static, but the camera {how}: the background moves by {percent_a_second:.0f} % of the "
        "image per second. If it moves, give --camera moving."),
    "camera-stands-against-told": ("warning", "camera",
        "You gave --camera moving, but the background stands still; --camera static makes up more certain."),
    "camera-motion-unknown": ("note", "camera",
        "It cannot be told whether the camera moves: too few corners of the background can be followed."),
    "image-without-up": ("note", "camera",
        "The image was not used to find which way is up: {reason}."),
    "image-up-in-frames": ("note", "camera",
        "The image shows which way is up in {looks} of the frames that were checked."),
    "image-up": ("note", "camera",
        "According to {source} of the image, the camera's pitch is {pitch_deg:.1f} and its roll {roll_deg:.1f} "
        "degrees, within {within_deg:.1f}."),
    "image-focal": ("note", "camera",
        "According to the image, the focal length is {focal_px:.0f} pixels, within {within_px:.0f}."),
    # Left and right
    "sides-put-right": ("repair", "left and right",
        "Left and right were corrected as asked: {repair}."),
    "sides-wrong-as-asked": ("warning", "left and right",
        "With left and right as you asked for them, they are {verdict}: {evidence}."),
    "sides-doubtful": ("warning", "left and right",
        "Left and right are doubtful: {evidence}."),
    "swaps-found": ("warning", "left and right",
        "The {what} look wrong: {swaps} ({wrong} of {of:~row}). --set read.swaps=repair corrects this, --set "
        "read.swaps=mask removes it."),
    "swaps-doubtful": ("warning", "left and right",
        "The {what} look wrong: {doubt}."),
    "swaps-repaired": ("repair", "left and right",
        "The {what} were corrected as asked: {swaps} ({wrong} of {of:~row})."),
    "swaps-masked": ("repair", "left and right",
        "The {what} were masked as asked: {swaps} ({wrong} of {of:~row})."),
    "swapped-keypoints": ("warning", "left and right",
        "If the poses were lifted from these keypoints, {wrong} of them are wrong. Leave --poses out and give "
        "--set read.swaps=repair: then the keypoints are lifted again."),
    "masked-with-keypoints": ("repair", "left and right",
        "{wrong:~pose was/poses were} masked as asked, because left and right are exchanged in the keypoints "
        "there."),
    # Lifting
    "keypoints-left-out": ("repair", "",
        "{frames:~frame} of 2D keypoints {frames:?was/were} not lifted, because all keypoints are somewhere else "
        "there."),
    "joints-on-a-line": ("repair", "",
        "{joints} missing keypoints were filled in by a straight line between the frames around them."),
    "lifted": ("note", "",
        "The built-in lifter made the poses from the 2D keypoints (network {model})."),
    "lifted-by": ("note", "",
        "The poses were lifted by {model}, a network of the kind {kind}{licence}."),
    "focal-guessed": ("note", "camera",
        "The focal length is unknown; it was assumed to be {focal_px:.0f} pixels (--focal)."),
    "lifters-own-path": ("note", "place",
        "The path of the pelvis is the lifter's own{at}; it has no stated error."),
    "focal-of-the-network": ("note", "place",
        "The lifter assumes a focal length of {focal_px:.0f} pixels, so its own path of the pelvis is not used. "
        "Give --focal."),
    "focal-not-used": ("note", "camera",
        "The lifter does not use the focal length."),
    "bearing-shifts-heading": ("note", "camera",
        "Without the focal length the heading is off by {least_deg:.0f} to {most_deg:.0f} degrees (for "
        "{focal_px:.0f} pixels), because the lifter sees the person in a crop. Give --focal PIXELS."),
    "frames-without-joints": ("warning", "",
        "{frames:~frame was/frames were} not lifted, because keypoints are missing for too long."),
    "frames-without-person": ("warning", "",
        "{frames:~frame has/frames have} keypoints, but the lifter finds nobody in the images."),
    "frames-without-numbers": ("warning", "",
        "{frames:~frame has/frames have} keypoints, but the lifter's answer to them is not a number."),
    "frames-without-scale": ("warning", "",
        "{frames:~frame has/frames have} limbs whose depth alone is longer than any person's limbs."),
    # Cleaning, scaling, placing
    "seam": ("mark", "",
        "The estimator started a new clip here."),
    "rows-inserted": ("repair", "",
        "{count:~frame} that the estimator dropped {count:?was/were} put back as gaps."),
    "spikes-removed": ("repair", "",
        "{count:~single-frame jump} of a joint {count:?was/were} removed."),
    "strays-removed": ("repair", "",
        "{count:~frame} alone between leaps of the whole pose {count:?was/were} removed."),
    "gaps-filled": ("repair", "",
        "{count:~missing joint position} in gaps of up to {max_gap_s} s {count:?was/were} interpolated."),
    "images-lacking": ("repair", "",
        "The recording has no images {when}; filters bridge gaps of up to {bridged_s} s."),
    "images-lacking-long": ("warning", "view",
        "The recording has no images {when}; walks and repetitions end there."),
    "joints-missing": ("warning", "",
        "{count:~joint position/joint positions} stayed missing."),
    "not-in-image": ("warning", "view",
        "The {part} {parts:?is/are} not in the image {when}; results that need {parts:?it/them} are missing there."),
    "image-size-doubtful": ("warning", "view",
        "{share_percent:.0f} % of the 2D keypoints lie far outside an image of {width} x {height} pixels, up to x "
        "= {right:.0f} and y = {down:.0f}. Give the size of their own image (--set read.image_size); else the "
        "place is wrong."),
    "not-seen": ("warning", "view",
        "The detector does not see the {part} {when}; results that need {parts:?it/them} are missing there."),
    "no-scale": ("warning", "",
        "Lengths have no unit. For metres give the person's height (--stature METRES)."),
    "scaled": ("repair", "",
        "Lengths were scaled by {factor:.4g} to a stature of {stature_m} m."),
    "scale-assumed": ("warning", "",
        "Lengths are in metres of the person that the estimator assumes; an image does not show how tall somebody is. "
        "Give the person's height (--stature METRES)."),
    "scaled-by-flights": ("warning", "",
        "Metres come from how fast the body falls in {flights:~flight}: the stature is {stature_m:.2f} ± "
        "{within_m:g} m, and lengths and speeds are within {percent:g} %. --stature METRES makes them more "
        "certain."),
    "not-placed": ("note", "place",
        "It is not known where the person is: {reason}."),
    "placed": ("note", "place",
        "The path of the pelvis comes from the keypoints, in {placed} of {frames} frames{bridges}. Each frame is "
        "within {within:g} {unit}, mostly in depth, the whole path within {size_percent:g} %; "
        "{depth}{guess}{unjudged}."),
    "size-levelled": ("repair", "place",
        "The lifted body grew with its size in the image, by {grown_percent:.0f} % in all; it was brought to one "
        "size."),
    # Up
    "frames-not-rectified": ("warning", "up",
        "{lost} of {frames:~frame} {lost:?has/have} too few joints of the trunk to be turned upright."),
    "not-levelled": ("warning", "up",
        "The take could not be levelled: {reason}."),
    "nobody-upright": ("suspicious", "up",
        "The trunk is tilted by more than {off_deg:.0f} degrees in {share_percent:.0f} % of the frames: the person"
        " lies or bends down, or the image is turned. If so, turn the video."),
    "up-drifts": ("warning", "up",
        "By the body, up changes by {drift_deg:.0f} degrees at frame {frame}: a cut, a moving camera (--camera "
        "moving), or a person who lies or bends down for long."),
    "up-of-one-apart": ("warning", "up",
        "Up from this person is {apart_deg:.0f} degrees from the up of the recording: the person leans or lies for"
        " long, or the lifter tilted the poses."),
    "image-against-bodies": ("warning", "up",
        "The image's {seen_in} and the skeletons disagree about up by {apart_deg:.0f} degrees: {answers}. The "
        "{believed} believed."),
    "told-up-contradicted": ("warning", "up",
        "The gravity that you gave and {other} differ by {apart_deg:.0f} degrees, more than their errors explain; "
        "yours is believed."),
    # Motion and angles
    "relative-to-camera": ("note", "motion",
        "The camera moves, so x and y are relative to it. Heights (z, vz, az) and distances are right; other "
        "speeds and accelerations contain the camera's turns."),
    "smoothed-by-stated-error": ("note", "motion",
        "Paths are smoothed according to the joint errors that the lifter states{unjudged}."),
    "smoothed-by-estimated-error": ("note", "motion",
        "Paths are smoothed according to a joint error that is estimated from them. It does not show slow errors, "
        "so paths, velocities and accelerations have no standard deviation."),
    "foot-not-locked": ("note", "motion",
        "Feet were not held in place on the floor: this needs a camera that stands still and a pelvis path from "
        "keypoints."),
    "gait-errors-unknown": ("note", "motion",
        "The errors of the gait figures are not known: these poses{by} were not compared with a truth."),
    "gait-unlike-any-seen": ("warning", "motion",
        "The errors of gait were fitted on people whose {gait} had no such values: {figures}. The stated errors "
        "were not compared with a truth there."),
    "single-frame": ("warning", "motion",
        "A single frame has no path, so velocities and accelerations are missing."),
    "not-filtered": ("warning", "motion",
        "{fps:.4g} frames per second are too few for a filter at {cutoff_hz:g} Hz, so the joints are not filtered."),
    "cutoff-lowered": ("note", "motion",
        "The cut-off is {cutoff_hz:g} Hz instead of {asked_hz:.3g} Hz: a Savitzky-Golay filter allows no higher "
        "one at {fps:.4g} frames per second."),
    "pieces-too-short": ("warning", "motion",
        "{values} joint positions were seen for too short a time between gaps to be smoothed at {cutoff_hz:g} Hz; "
        "their {missing} are missing."),
    "times-uneven": ("note", "motion",
        "The time stamps of {frames:~frame} are not evenly spaced; the filter works on even times."),
    "angles-left-out": ("note", "motion",
        "Angles left out (in brackets: frames): {angles}. Reason: {reason}."),
    "angles-from-neutral": ("note", "motion",
        "All angles are relative to the person standing from {begin_s:g} to {end_s:g} s{of} (--neutral), and so "
        "are their errors. Anatomical limits and OpenSim's names do not hold for them."),
    "neutral-moves": ("warning", "motion",
        "The person moves by {moved_deg:.0f} degrees from {begin_s:g} to {end_s:g} s{of}. For --neutral choose a "
        "span in which the person stands still."),
    "angle-errors-unknown": ("note", "motion",
        "The errors of the angles are not known. Say whether the poses were measured or estimated (-O "
        "made_by=measured, or -O made_by=estimated)."),
    "angle-errors-of-world": ("note", "motion",
        "The errors of the angles are not known: the poses were estimated{by} in world axes, where no estimator "
        "was compared with a truth."),
    "angle-errors-unjudged": ("note", "motion",
        "The errors of the angles are not known: the poses were estimated{by}, which was not compared with a "
        "truth. Give {more}a file of its errors (--set angles.errors=FILE)."),
    "angle-errors-by-disagreement": ("note", "motion",
        "The errors of the angles are estimated: these poses{by} were compared with the built-in lifter's on the "
        "same keypoints."),
    "angle-errors-of-file": ("note", "motion",
        "The errors of the angles come from the given file, which states them for {lifter}; the poses were "
        "estimated{by}."),
    "angle-errors-unused": ("warning", "motion",
        "The given file of angle errors was not used: it is for poses that were estimated in camera axes, and "
        "these {are}."),
    # Files that were written
    "c3d-too-long": ("warning", "files",
        "{file} was not written: C3D numbers {most} frames at most, and the take has {frames} at an even rate. "
        "Write TRC (--also trc), or a part of the take (--time-range)."),
    "c3d-single-frame": ("warning", "files",
        "{file} was not written, because a single frame has no rate. Write TRC (--also trc)."),
    "c3d-begins": ("note", "files",
        "{file}: its first frame, number 1, is at {begin_s:.3f} s of the take."),
    "animation-stays": ("note", "files",
        "{file}: the pelvis stays in one place, because its path is not known."),
    "animation-origin": ("note", "files",
        "{file}: its origin is {left:.2f} to the left, {up:.2f} up and {front:.2f} in front of the origin of TRC."),
    "animation-unit": ("note", "files",
        "{file}: lengths have no unit, because the source has no scale."),
    "animation-cut": ("note", "files",
        "{file}: {before:~frame} at the beginning and {after:~frame} at the end have no pose and were left out."),
    "animation-begins": ("note", "files",
        "{file}: its time 0 is at {begin_s:.3f} s of the take."),
    "animation-held": ("note", "files",
        "{file}: in {held} of {frames:~frame} nothing is known of {joints}; the last known value is kept."),
    "annotated-begins": ("note", "files",
        "{file} begins with frame {frame} of the video, at {begin_s:.3f} s."),
    "video-copied": ("note", "files",
        "The recording holds an H.264 copy of the video, because {reason}."),
    # What is wrong with poses
    "too-few-frames": ("suspicious", "poses",
        "Fewer than two frames have all joints: too few to tell whether the poses are good."),
    "gaps": ("note", "poses",
        "{lost} of {frames:~frame} {lost:?is/are} missing: {absent} without a row (at most {longest} in a row), "
        "{incomplete} with NaN, {empty} with all joints at one point."),
    "duplicates": ("note", "poses",
        "{repeated:~row repeats/rows repeat} the one before exactly, the first is row {first}; speeds are wrong "
        "there."),
    "frames-not-numbered": ("note", "poses",
        "The file does not say which video frames its rows belong to."),
    "rate-not-stated": ("note", "poses",
        "The file does not say its frame rate."),
    "swaps": ("note", "poses",
        "{wrong} of {of:~row} {wrong:?looks/look} wrong: {swaps}."),
    "swaps-unsure": ("note", "poses",
        "Some rows look wrong: {doubt}."),
    "rebase": ("suspicious", "poses",
        "In every frame the outermost joint lies at {axis} = 0 exactly: the pelvis's movement along that axis was "
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
        "{count} of {rows_read:~row} come again exactly: the clip plays more than once, so counts and cadences are"
        " wrong."),
    "only-noise": ("suspicious", "poses",
        "Hands and feet jump to and fro and move no further: this is noise, a single pose, or rows in the wrong "
        "order."),
    "image-stretched": ("suspicious", "files",
        "The body looks about {times:.2g} times too {way}, as in a stretched image. Give the video, or the "
        "keypoints and the image size, as recorded."),
    "camera-zooms": ("suspicious", "camera",
        "The body grows in the image by about {percent:.1f} % in 1/30 s, and its steps do not explain that: the "
        "camera seems to zoom. Then place and speed are wrong."),
    "keypoints-smooth": ("warning", "files",
        "Hands' and feet's keypoints hardly move faster than {hertz:g} Hz ({share_percent:.1f} %): they were "
        "smoothed or computed. Give the detector's own."),
    "no-quick-movement": ("suspicious", "poses",
        "Hands and feet hardly move faster than {hertz:g} Hz (only {share_percent:.1f} % of their movement does): "
        "the poses were smoothed."),
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
        "The limbs imply a stature of {stature_m:.3g} m. Check that the unit of the file is really metres."),
    "upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: the file's vertical axis seems to be "
        "upside down, or the person stands on the hands. If its y points up, read it with --adapter arrays -O "
        "frame=GL_CAMERA (or Y_UP) and its layout and unit, such as -O layout=H36M17 -O unit=mm (-O unit=arbitrary"
        " if it has no scale)."),
    "picture-upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: turn the image before the run, unless "
        "the person stands on the hands."),
    "leaps": ("suspicious", "poses",
        "The whole pose leaps from one frame to the next at {count:~row}, first at row {first}."),
    "seams": ("note", "poses",
        "The estimator started a new clip at row {listed}."),
    "seams-step": ("note", "poses",
        "The estimator started a new clip at row {listed}; the pose steps there by up to {times:.1f} times its "
        "usual movement."),
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
    "keypoints-shifted": ("suspicious", "poses",
        "The poses fit the keypoints better {lag:~frame} {direction}: they are off by {better_percent:.0f} % "
        "instead of {off_percent:.0f} % of the person's size, over {frames:~frame} of track {person}."),
    "keypoints-missed": ("suspicious", "poses",
        "The poses are off the keypoints by {off_percent:.0f} % of the person's size, over {frames:~frame} of "
        "track {person}."),
    "keypoints-met": ("note", "poses",
        "The poses fit the keypoints within {off_percent:.0f} % of the person's size, over {frames:~frame} of "
        "track {person}."),
}  # fmt: skip
CATALOGUE = {code: Entry(*entry) for code, entry in (_ENTRIES | COMPARING).items()}
