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


_DEPENDS = "speeds, accelerations, durations and cadences depend on it"

_ENTRIES: dict[str, tuple[Weight, About, str]] = {
    # What was read
    "part-only": ("note", "files",
        "Only the part from {part} is processed, as asked; the whole is from {whole}."),
    "part-covered": ("note", "files",
        "The data cover video frames {first} to {last} of {frames}."),
    "frames-unknown": ("warning", "files",
        "Nothing says which video frames the rows are; they are counted from 0."),
    "gaps-as-asked": ("repair", "files",
        "Taken for gaps as asked: {counts}."),
    "video-cut-off": ("warning", "files",
        "The images of {file} end after {ends_s:.1f} s, but the file says that it lasts {stated_s:.1f} s: it may "
        "be cut off or damaged, so that the rest is missing; copy it again."),
    "video-damaged": ("warning", "files",
        "The video is damaged at frame {frames}; images there, and behind it until the next key frame, may be "
        "wrong or missing: copy it again, or leave that part out (--time-range)."),
    "scene-changes": ("warning", "files",
        "The video changes to another scene {count:~time}, at frame {frames}; nobody is followed from one scene to "
        "the next."),
    "scenes-apart": ("note", "files",
        "Only people of the same scene of the video share LEVEL and the camera."),
    "people-by-poses-alone": ("warning", "files",
        "People have no track numbers and no boxes in this file; they are told apart by their poses alone, so "
        "check that each is one person throughout."),
    "keypoints-of-somebody-else": ("suspicious", "files",
        "The limbs of person '{person}' in the poses lie otherwise in the image than those of person '{track}' in "
        "the keypoints, by {apart:.2f} of their spread ({most:g} at most of one person): somebody else's "
        "keypoints, or of other frames; what rests on both, as where the person is, is wrong then."),
    "keypoints-not-of-poses": ("suspicious", "files",
        "The poses are off the keypoints of their frames by {off_percent:.1f} % of the stature{how}: keypoints of "
        "another recording or other frames, or poses that were changed."),
    "leap-between-people": ("warning", "files",
        "The person leaps by {sizes:.1f} body sizes at frame {frame}: it may be somebody else from there on."),
    "leap-after-gap": ("warning", "files",
        "The person leaps by {sizes:.1f} body sizes at frame {frame}, after {unseen:~frame} in which nobody was "
        "seen: it may be somebody else from there on."),
    "no-joint-centres": ("warning", "files",
        "Left out, because they are not joint centres: the points of {people}."),
    "no-track-number": ("warning", "files",
        "Left out, because they have no track number: {unnamed:~detection} of {detections}; track=true "
        "(--set keypoints.track=true) ignores the numbers and joins people to the nearest of the frames before."),
    "rebased-to-floor": ("warning", "files",
        "The lowest joint was put at height 0 in {rebased} of {frames:~frame}, and it was another one "
        "{changes:~time}: the file holds no vertical movement of the body as a whole. Poses relative to the pelvis "
        "are unharmed; --disable-rebase-keypoint of MMPose leaves the heights as they were."),
    "display-undone": ("warning", "files",
        "A rotation for display was undone as asked for, on the assumption that it was that of Human3.6M's "
        "camera 54138969; if the script used another, the body is tilted."),
    "stature-assumed": ("warning", "files",
        "RTMW3D's file has no scale across the picture; a stature of {stature_m:g} m was assumed."),
    "figures-withheld": ("warning", "poses",
        "The poses are unusable, so no figures are made of them (--set measures.unusable=true makes them)."),
    # The clock
    "slow-motion-stated": ("warning", "clock",
        "The video was captured at {captured_fps:g} frames per second and is shown at {shown_fps:.4g}, as slow "
        "motion, but {used_fps:.4g} are used: give --fps {captured_fps:g}, or durations are {times:.3g} times too "
        "long and speeds as many times too low."),
    "fps-contradicts": ("warning", "clock",
        "--fps {used_fps:g} is used although the {source} says {shown_fps:g} frames per second: if that is right, "
        "speeds and cadences are {times:.3g} times what they should be; leave --fps out."),
    "clocks-contradict": ("warning", "clock",
        "The video's {shown_fps:.4g} frames per second are used although the file's own times say "
        "{stated_fps:.4g}: if the file is right, as it may be of slow motion, give --fps {stated_fps:.4g}; speeds "
        "and cadences are {times:.3g} times what they should be."),
    "falls-slowly": ("warning", "clock",
        "In {flights:~flight}, with both feet off the ground, the body falls at {share:.2g} of gravity, as in "
        "slow motion of {times:.2g} times: if the camera captured at about {fps:g} frames a second, give --fps "
        "{fps:g}; speeds, accelerations and durations depend on it."),
    "falls-fast": ("warning", "clock",
        "In {flights:~flight}, with both feet off the ground, the body falls at {share:.2g} of gravity, as in a "
        "time lapse of {times:.2g} times: if the camera captured at about {fps:g} frames a second, give --fps "
        "{fps:g}; speeds, accelerations and durations depend on it."),
    "moves-slowly": ("warning", "clock",
        "At {fps:.4g} frames a second {found}, slower than people usually move: if this is slow motion, give the "
            f"rate at which the camera captured with --fps; {_DEPENDS}."),
    "moves-fast": ("warning", "clock",
        "At {fps:.4g} frames a second {found}, faster than people can move: if the video is a time lapse, or its "
            f"rate is told wrongly, give the rate at which the camera captured with --fps; {_DEPENDS}."),
    "gait-against-rate": ("suspicious", "clock",
        "At {fps:.4g} frames a second the legs {gait}, and pass each other every {step_s:.2f} s, {times:.1f} times "
        "too {way} for steps of that length: give the rate at which the camera captured with --fps, about {fits:.2g} "
            f"frames a second by the gait; {_DEPENDS}."),
    "movement-against-rate": ("suspicious", "clock",
        "At {fps:.4g} frames a second the body moves about {times:.1f} times too {way} for people; at about {fits:.2g} "
        "it moves as usual: give the rate at which the camera captured with --fps. "
            f"{_DEPENDS[0].upper()}{_DEPENDS[1:]}."),
    "played-backwards": ("suspicious", "clock",
        "The body moves as in a clip that is played backwards: sort the frames, unless the person moves backwards."),
    "rows-lost": ("suspicious", "clock",
        "At {count:~row} the whole body moves on by more than one frame's movement, {how}: frames may have been left "
        "out of the file without a trace; write it with frame numbers or times, or give --fps."),
    # Keypoints and video
    "video-not-compared": ("note", "files",
        "Whether the keypoints are of this video cannot be told: {reason}."),
    "keypoints-move-as-video": ("note", "files",
        "The keypoints move as the image beneath them (agreement {alike:.2f})."),
    "keypoints-not-of-video": ("suspicious", "files",
        "The keypoints do not move as the image beneath them (agreement {alike:.2f}; 0.45 and more is usual){how}. "
        "Give the keypoints of this video, numbered by its frames."),
    # Detecting
    "detected": ("note", "files",
        "The 2D keypoints were detected in the video by {detector}."),
    "person-chosen": ("note", "files",
        "People were followed under {people:~number} (frames in brackets): {listed}{unsure}. Number {person} is taken, "
        "seen in frames {first} to {last}; choose with --person."),
    "hardly-a-person": ("warning", "view",
        "The detector is hardly sure that person {person} is a person: the scores of shoulders and hips are "
        "{score:.2f} (people have 0.6 and more). Look at the key frames: a tree or a shadow may have passed for "
        "one, or the picture cuts them off."),
    "interrupted": ("warning", "files",
        "Interrupted at frame {frame} of {frames}; --resume goes on from there."),
    # The camera
    "camera-moves": ("note", "camera",
        "The camera {how}: the background of its images moves by {percent_a_second:.0f} % of the image a second, so "
        "every frame has an up of its own (--camera static if it stands still)."),
    "camera-moves-against-told": ("warning", "camera",
        "The camera was told to stand still, but it {how}: the background of its images moves by "
        "{percent_a_second:.0f} % of the image a second (--camera moving)."),
    "camera-stands-against-told": ("warning", "camera",
        "The camera was told to move, but the background of its images stands still; up is surer with --camera "
        "static."),
    "camera-motion-unknown": ("note", "camera",
        "Whether the camera moves cannot be told from its images: too few corners of the background are found again."),
    "image-without-up": ("note", "camera",
        "Which way is up does not rest on the image: {reason}."),
    "image-up-in-frames": ("note", "camera",
        "The image tells which way is up in {looks} of the frames looked at."),
    "image-up": ("note", "camera",
        "By {source} of the image the camera's pitch is {pitch_deg:.1f} and its roll {roll_deg:.1f} degrees, "
        "within {within_deg:.1f}."),
    "image-focal": ("note", "camera",
        "By the image the focal length is {focal_px:.0f} pixels, within {within_px:.0f}."),
    # Left and right
    "sides-put-right": ("repair", "left and right",
        "Left and right were put right as asked: {repair}."),
    "sides-wrong-as-asked": ("warning", "left and right",
        "Left and right are {verdict} as asked for: {evidence}."),
    "sides-doubtful": ("warning", "left and right",
        "Left and right are doubtful: {evidence}."),
    "swaps-found": ("warning", "left and right",
        "The {what} look wrong: {swaps} ({wrong} of {of:~row}); --set read.swaps=repair or mask changes that."),
    "swaps-doubtful": ("warning", "left and right",
        "The {what} look wrong: {doubt}."),
    "swaps-repaired": ("repair", "left and right",
        "The {what} were put right as asked: {swaps} ({wrong} of {of:~row})."),
    "swaps-masked": ("repair", "left and right",
        "The {what} were masked as asked: {swaps} ({wrong} of {of:~row})."),
    "swapped-keypoints": ("warning", "left and right",
        "If the poses are a lift of these keypoints, {wrong} of them are wrong in all joints; without --poses and "
        "with --set read.swaps=repair the keypoints are lifted again."),
    "masked-with-keypoints": ("repair", "left and right",
        "{wrong:~pose was/poses were} masked as asked, because the keypoints are exchanged there."),
    # Lifting
    "keypoints-left-out": ("repair", "",
        "{frames:~frame} of 2D keypoints, between leaps of the whole person, left out of the lift."),
    "joints-on-a-line": ("repair", "",
        "{joints} missing keypoints were bridged by a line between the frames around them."),
    "lifted": ("note", "",
        "The poses are the built-in lifter's, from the 2D keypoints (network {model})."),
    "lifted-by": ("note", "",
        "The poses are the lift by {model}, a network of the kind {kind}{licence}."),
    "focal-guessed": ("note", "camera",
        "The focal length is unknown and taken for {focal_px:.0f} pixels (--focal)."),
    "lifters-own-path": ("note", "place",
        "The pelvis's path is the lifter's own{at}; it states no error."),
    "focal-of-the-network": ("note", "place",
        "The lifter assumes a focal length of {focal_px:.0f} pixels, which was not measured, so its own pelvis path "
        "is not used (--focal)."),
    "focal-not-used": ("note", "camera",
        "The lifter answers without it: the focal length is not used for the lift."),
    "bearing-shifts-heading": ("note", "camera",
        "The lifter sees the person in a crop and answers along the ray to the person: a bearing of b degrees "
        "shifts the heading by about b, here by {least_deg:.0f} to {most_deg:.0f} degrees if the focal length is "
        "{focal_px:.0f} pixels; --focal PIXELS takes it out."),
    "frames-without-joints": ("warning", "",
        "{frames:~frame has/frames have} no keypoints for too long to be lifted."),
    "frames-without-person": ("warning", "",
        "{frames:~frame has/frames have} keypoints, but the lifter sees nobody in their pictures."),
    "frames-without-numbers": ("warning", "",
        "{frames:~frame has/frames have} keypoints, but the lifter's answer to them is no number."),
    "frames-without-scale": ("warning", "",
        "{frames:~frame has/frames have} limbs that are longer in depth alone than any person's."),
    # Cleaning, scaling, placing
    "seam": ("mark", "",
        "The estimator began a new clip here."),
    "rows-inserted": ("repair", "",
        "{count:~frame} that the estimator dropped {count:?was/were} put back as gaps."),
    "spikes-removed": ("repair", "",
        "{count:~single-frame jump} of a joint {count:?was/were} removed."),
    "strays-removed": ("repair", "",
        "{count:~frame} alone between leaps of the whole pose {count:?was/were} removed."),
    "gaps-filled": ("repair", "",
        "{count:~missing joint position} in gaps of up to {max_gap_s} s {count:?was/were} interpolated."),
    "images-lacking": ("repair", "",
        "The recording lacks images {when}; filters go on across gaps of up to {bridged_s} s."),
    "images-lacking-long": ("warning", "view",
        "The recording lacks images {when}; no filter goes across that, and walks and repetitions end there."),
    "joints-missing": ("warning", "",
        "{count:~joint position is missing and stays so./joint positions are missing and stay so.}"),
    "not-in-image": ("warning", "view",
        "The {part} {parts:?is/are} not in the image {when}; what needs {parts:?it/them} is left out there."),
    "image-size-doubtful": ("warning", "view",
        "{share_percent:.0f} % of the 2D keypoints lie far outside an image of {width} x {height} pixels, up to x = "
        "{right:.0f} and y = {down:.0f}: the told size (--set read.image_size) seems to be another image's. What the "
        "picture cuts off is not told, and the person's place is wrong then."),
    "not-seen": ("warning", "view",
        "The {part} {parts:?is/are} not seen by the detector {when}; what needs {parts:?it/them} is left out "
        "there."),
    "no-scale": ("warning", "",
        "Lengths are not in metres but in units of their own, for nothing tells the scale. Give the person's height "
        "(--stature METRES) for metres."),
    "scaled": ("repair", "",
        "Scaled by {factor:.4g} to a stature of {stature_m} m."),
    "scaled-by-flights": ("warning", "",
        "The person's height was not given: metres come from how fast the body falls in {flights:~flight}, by which "
        "the stature is {stature_m:.2f} ± {within_m:g} m. Path, speed and lengths are within {percent:g} % "
        "together; with --stature METRES they are surer."),
    "not-placed": ("note", "place",
        "The place of the person is not known: {reason}."),
    "placed": ("note", "place",
        "The pelvis's path rests on the keypoints, in {placed} of {frames} frames{bridges}: each "
        "frame is within {within:g} {unit}, mostly in depth, and the whole within "
        "{size_percent:g} % for the body's size; {depth}{guess}{unjudged}."),
    "size-levelled": ("repair", "place",
        "The lifted body grew with its image, by {grown_percent:.0f} % in all, and was brought to one size."),
    # Up
    "frames-not-rectified": ("warning", "up",
        "{lost} of {frames:~frame} {lost:?has/have} too few torso joints to rectify."),
    "not-levelled": ("warning", "up",
        "The take could not be levelled: {reason}."),
    "nobody-upright": ("suspicious", "up",
        "The trunk is more than {off_deg:.0f} degrees off up in {share_percent:.0f} % of the frames: the person "
        "lies or bends down, or the picture is turned. If it is, turn the video, or tell read.pitch and "
        "read.roll."),
    "up-drifts": ("warning", "up",
        "The camera was taken for one that stands still, but by the body up changes by {drift_deg:.0f} degrees at "
        "frame {frame}: a cut, a moving camera (--camera moving), or a body that lies or bends "
        "down for long."),
    "up-of-one-apart": ("warning", "up",
        "This person's own up is {apart_deg:.0f} degrees from the one that all of the recording share: they lean, "
        "bend down or lie for long, or the lifter tilted them."),
    "image-against-bodies": ("warning", "up",
        "The image's {seen_in} and the skeletons contradict each other about up by {apart_deg:.0f} degrees: "
        "{answers}. The {believed} believed."),
    "told-up-contradicted": ("warning", "up",
        "What was told about gravity and {other} are {apart_deg:.0f} degrees apart, more than their errors "
        "explain; what was told is believed."),
    # Motion and angles
    "relative-to-camera": ("note", "motion",
        "The camera moves, so x and y are relative to it: heights (z, vz, az) and distances hold, but its turning "
        "about the vertical cannot be told from the body's and enters vx, vy, ax, ay, speed and acceleration."),
    "smoothed-by-stated-error": ("note", "motion",
        "Paths, velocities and accelerations are smoothed by the error of the joints that the lifter "
        "states{unjudged}."),
    "smoothed-by-estimated-error": ("note", "motion",
        "Paths, velocities and accelerations are smoothed by an error of the joints that is estimated from the "
        "paths. This does not show slow errors, so {what} have no standard deviations."),
    "foot-not-locked": ("note", "motion",
        "No foot is locked: there is no pelvis path from keypoints and a camera that stands still."),
    "gait-errors-unknown": ("note", "motion",
        "The errors of the gait's figures are not known: these poses{by} have not been compared with a truth."),
    "gait-unlike-any-seen": ("warning", "motion",
        "The errors of gait were fitted on people who did not have {figures}, {gait}: the errors grow with the "
        "distance, and were not compared with a truth there."),
    "single-frame": ("warning", "motion",
        "A single frame has no path: velocities and accelerations are missing."),
    "not-filtered": ("warning", "motion",
        "{fps:.4g} frames a second do not carry a filter at {cutoff_hz:g} Hz: joints are unfiltered, and the rates "
        "of angles are those of the noise too."),
    "cutoff-lowered": ("note", "motion",
        "The cut-off is {cutoff_hz:g} Hz instead of {asked_hz:.3g} Hz: a Savitzky-Golay filter has no higher one "
        "at {fps:.4g} frames a second."),
    "pieces-too-short": ("warning", "motion",
        "{values} joint positions lie in unbroken pieces that are too short for the {cutoff_hz:g} Hz filter; "
        "their {missing} are missing."),
    "times-uneven": ("note", "motion",
        "The time stamps of {frames:~frame} are not evenly spaced: paths were brought to even ones for the "
        "filter, and back."),
    "angles-left-out": ("note", "motion",
        "Angles left out, frames: {angles}: {reason}."),
    "angles-from-neutral": ("note", "motion",
        "All angles are from those of the person standing from {begin_s:g} to {end_s:g} s (--neutral), which are "
        "subtracted; their errors are those of the difference. Limits of anatomy and the names of OpenSim do not hold "
        "for them."),
    "neutral-moves": ("warning", "motion",
        "The person moves by {moved_deg:.0f} degrees from {begin_s:g} to {end_s:g} s, which --neutral takes for "
        "standing still; choose a second in which they stand."),
    "angle-errors-unknown": ("note", "motion",
        "The errors of the angles are not known, for nothing says whether the poses were measured or estimated "
        "(-O made_by=measured, or -O made_by=estimated)."),
    "angle-errors-of-world": ("note", "motion",
        "The errors of the angles are not known: the poses were estimated{by} in a world's axes, where no "
        "estimator has been judged."),
    "angle-errors-unjudged": ("note", "motion",
        "The errors of the angles are not known: the poses were estimated{by}, which was not compared with a truth; "
        "give {more}a file of its errors (--set angles.errors=FILE)."),
    "angle-errors-by-disagreement": ("note", "motion",
        "The errors of these poses{by} were not measured; those of the angles are stated by how far they are from "
        "the built-in lifter's on the same keypoints."),
    "angle-errors-of-file": ("note", "motion",
        "The errors of the angles are those that the given file states of {lifter}; the poses were estimated{by}."),
    "angle-errors-unused": ("warning", "motion",
        "The given file of angles' errors is not used: it is of poses that were estimated in a camera's axes, and "
        "these {are}."),
    # Files that were written
    "c3d-too-long": ("warning", "files",
        "{file} was not written: C3D numbers {most} frames at most, and the take has {frames} at one even rate; "
        "write TRC (--also trc), or a part of it (--time-range)."),
    "c3d-single-frame": ("warning", "files",
        "{file} was not written: a C3D file states a rate, and a single frame has none; write TRC (--also trc)."),
    "c3d-begins": ("note", "files",
        "{file}: its first frame, which has the number 1, is at {begin_s:.3f} s of the take."),
    "animation-stays": ("note", "files",
        "{file}: the pelvis stays where it is, because its path is not known."),
    "animation-origin": ("note", "files",
        "{file}: its origin is {left:.2f} to the left, {up:.2f} up and {front:.2f} in front of the one that TRC "
        "counts from."),
    "animation-unit": ("note", "files",
        "{file}: its lengths are in the source's own unit, because the source has no scale."),
    "animation-cut": ("note", "files",
        "{file}: what has no pose is left out, {before:~frame} at the beginning and {after:~frame} at the end."),
    "animation-begins": ("note", "files",
        "{file}: its time begins with 0 at {begin_s:.3f} s of the take."),
    "animation-held": ("note", "files",
        "{file}: in {held} of {frames:~frame} nothing is known of {joints}; the last known value is kept."),
    "annotated-begins": ("note", "files",
        "{file} begins with frame {frame} of the video, at {begin_s:.3f} s."),
    "video-copied": ("note", "files",
        "The recording holds an H.264 copy of the video, because {reason}."),
    # What is wrong with poses
    "too-few-frames": ("suspicious", "poses",
        "Fewer than two frames have all joints: they show neither steady bones nor movement, so nobody can say that "
        "the poses are good."),
    "gaps": ("note", "poses",
        "{lost} of {frames:~frame} {lost:?is/are} not there: {absent} without a row (at most {longest} in a row), "
        "{incomplete} with NaN, {empty} with all joints on one point."),
    "duplicates": ("note", "poses",
        "{repeated:~row repeats/rows repeat} the one before exactly, the first is row {first}; speeds are wrong "
        "there."),
    "frames-not-numbered": ("note", "poses",
        "The file does not say which video frames its rows are."),
    "rate-not-stated": ("note", "poses",
        "The file does not say its frame rate."),
    "swaps": ("note", "poses",
        "{wrong} of {of:~row} {wrong:?looks/look} wrong: {swaps}."),
    "swaps-unsure": ("note", "poses",
        "Some rows look wrong: {doubt}."),
    "rebase": ("suspicious", "poses",
        "In every frame the outermost joint lies at {axis} = 0 exactly: each frame was moved onto the floor by "
        "itself, so the pelvis' way along that axis is lost, and speeds with it."),
    "flat": ("unusable", "poses",
        "All joints lie in one plane (thickness {thickness_percent:.1f} % of the trunk); there is no depth in it."),
    "axis-invented": ("unusable", "poses",
        "Nothing moves along {axis} while the body moves along other axes; that axis is invented."),
    "flattened-depth": ("suspicious", "poses",
        "Bones shorten when they turn towards the camera as if depth were {factor:.1f} times too small; it is "
        "flattened."),
    "depth-stretched": ("suspicious", "poses",
        "Bones grow when they turn towards the camera as if depth were {times:.1f} times too large; it is stretched."),
    "limbs-copied": ("suspicious", "poses",
        "One {limb} is a copy of the other: nothing can be said of right and left."),
    "repeats-itself": ("suspicious", "poses",
        "{count} of {rows_read:~row} come again exactly: the clip is played more than once, so that counts and "
        "cadences are of the loop."),
    "only-noise": ("suspicious", "poses",
        "Hands and feet jump to and fro from row to row and move no further: this is noise, one pose, or rows out of "
        "their order."),
    "image-stretched": ("suspicious", "files",
        "The body looks about {times:.2g} times too {way}, as in a stretched image: give the video, or the keypoints "
        "and the image's size, as the camera filmed it."),
    "camera-zooms": ("suspicious", "camera",
        "The body grows in the image by about {percent:.1f} % in 1/30 s, and not by its steps: the camera seems to "
        "zoom, and then place and speed are wrong."),
    "keypoints-smooth": ("warning", "files",
        "Almost no movement of the keypoints' hands and feet is quicker than {hertz:g} Hz ({share_percent:.1f} %), "
        "less than detectors leave: they were smoothed, so that quick movements are lost or too small, or computed."),
    "no-quick-movement": ("suspicious", "poses",
        "Nothing of the hands' and feet's movement is quicker than {hertz:g} Hz ({share_percent:.1f} % of it): the "
        "poses were smoothed, and quick movements are lost or too small."),
    "bones": ("suspicious", "poses",
        "Bone lengths vary by {spread_percent:.0f} % (5 % is usual, 9 % poor), that from {worst} by "
        "{worst_percent:.0f} %."),
    "limbs-unlike": ("suspicious", "poses",
        "The bone from {bone} is {times:.2f} times as long as the left one."),
    "mirrored": ("unusable", "poses",
        "The body is mirrored or its left and right are exchanged (--set read.handedness=mirror or swap): {evidence}."),
    "legs-against-arms": ("unusable", "poses",
        "Left and right of the legs contradict those of the arms (--set read.handedness=swap-legs): {evidence}."),
    "left-and-right": ("suspicious", "poses",
        "Left and right are doubtful: {evidence}."),
    "stature": ("suspicious", "poses",
        "The limbs imply a stature of {stature_m:.3g} m; is the unit of the file really metres?"),
    "upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: the file's vertical axis seems to be "
        "turned over. If its y points up, read it with --adapter arrays -O frame=GL_CAMERA (or Y_UP) and the "
        "layout and unit that it has, such as -O layout=H36M17 -O unit=mm, or -O unit=arbitrary where it has no "
        "scale; otherwise the person stands on their hands, or the camera on its head."),
    "picture-upside-down": ("suspicious", "poses",
        "The head is below the feet in {share_percent:.0f} % of the frames: the picture (or the keypoints' y axis) "
        "is upside down and has to be turned before the run, or the person stands on their hands."),
    "leaps": ("suspicious", "poses",
        "The whole pose leaps from one frame to the next at {count:~row}, the first is row {first}."),
    "seams": ("note", "poses",
        "The estimator began a new clip at row {listed}."),
    "seams-step": ("note", "poses",
        "The estimator began a new clip at row {listed}; the pose steps there by up to {times:.1f} times its usual "
        "movement."),
    "refused": ("unusable", "poses",
        "{reason}"),
    "video-apart": ("suspicious", "poses",
        "The poses reach frame {last}, the video ends with frame {ends}; they do not belong together."),
    "video-unnumbered": ("suspicious", "poses",
        "{rows_read:~row} without frame numbers for {frames:~frame} of the video: time may drift."),
    "video-fits": ("note", "poses",
        "{rows_read:~row} for {frames:~frame} at {fps:g} a second."),
    "keypoints-not-compared": ("note", "poses",
        "Not compared with the keypoints: {reason}."),
    "keypoints-shifted": ("suspicious", "poses",
        "The poses fit the keypoints better {lag:~frame} {direction}: {better_percent:.0f} % instead of "
        "{off_percent:.0f} % of the person's size over {frames:~frame} of track {person}."),
    "keypoints-missed": ("suspicious", "poses",
        "The poses miss the keypoints by {off_percent:.0f} % of the person's size over {frames:~frame} of track "
        "{person}."),
    "keypoints-met": ("note", "poses",
        "The poses meet the keypoints within {off_percent:.0f} % of the person's size over {frames:~frame} of "
        "track {person}."),
}  # fmt: skip
CATALOGUE = {code: Entry(*entry) for code, entry in (_ENTRIES | COMPARING).items()}
