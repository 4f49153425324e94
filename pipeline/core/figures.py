"""The catalogue of figures: what each is called, in which unit, who it is for, what it is, and where its error comes
from.

Keys of files, labels of pages, sentences and `pcnet3d list figures` are made from it. A take has no
figures but these (Measures in measures.py).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

# Who reads it: "first": on the first screen of a page; "page": on the page; "files": in files alone.
Audience = Literal["first", "page", "files"]


class Unit(NamedTuple):
    """How a unit is written: at the end of keys and columns, in tables, on pages. {} stands for the take's unit of
    length, which keys do not name."""

    ending: str = ""
    table: str = ""
    page: str = ""


UNITS = {
    "": Unit(),
    "deg": Unit("_deg", "deg", "°"),
    "degps": Unit("_degps", "deg/s", "°/s"),
    "s": Unit("_s", "s", "s"),
    "cm": Unit("_cm", "cm", "cm"),
    "percent": Unit("_percent", "%", "%"),
    "spm": Unit("_spm", "1/min", "steps/min"),
    "length": Unit("", "{}", "{}"),
    "speed": Unit("", "{}/s", "{}/s"),
    "moments": Unit("_s", "s", "s"),  # seconds of the take's clock, of a Moments
    "text": Unit(),  # of a Remark
}
OF_LENGTH = ("length", "speed")  # units that say something only where the take has a scale

# Where a figure's error comes from.
ERRORS = {
    "": "none",
    "angle": "the stated errors of the angle",
    "unchecked": "the stated errors of the angle; not compared with a truth",
    "repeated": "the stated errors of the angle, and the frame rate; of each lifted one 0.15 s",
    "sides": "the stated errors of both ranges, less what they have in common",
    "gait": "errors measured on lifted walks; of lengths, that of the pelvis path too",
    "spread": "none: given for six values or more that vary by more than the error of one",
    "flight": "errors measured on lifted jumps, and that of up",
    "unknown": "not known",
}


class Figure(NamedTuple):
    """One quantity. name: in keys, without its unit; label: in words, the clinical one first; unit: one of UNITS;
    group: one of GROUPS, in which it is defined; error: of ERRORS; definition: in a sentence."""

    name: str
    label: str
    unit: str
    group: str
    audience: Audience
    error: str
    definition: str

    @property
    def key(self) -> str:
        """`cadence_spm`: as in files."""
        return self.name + UNITS[self.unit].ending

    @property
    def error_key(self) -> str:
        """`cadence_error_spm`: the unit stays at the end."""
        return f"{self.name}_error{UNITS[self.unit].ending}"

    @property
    def within_key(self) -> str:
        """Of an index of right and left: the key that says whether zero lies within its error; "" of others."""
        is_index = self.name.endswith("symmetry_index")
        return self.name.replace("symmetry_index", "within_error") if is_index else ""

    def label_with_unit(self) -> str:
        """Such as "cadence (steps/min)", lengths in metres."""
        unit = UNITS[self.unit].page.format("m")
        return f"{self.label} ({unit})" if unit else self.label


class Group(NamedTuple):
    """The outermost groups of figures. movement: whether it is one that may happen in a take."""

    title: str
    definition: str
    movement: bool = False


GROUPS = {
    "range_of_motion": Group("ranges of motion", "of every angle"),
    "symmetry": Group("right and left", "ranges of both sides compared (Robinson et al. 1987)"),
    "walking": Group("walking and running", "steps, and the gait cycle of each foot", True),
    "knee_bends": Group(
        "knee bends", "both knees bend and straighten while the feet stay in place; sitting down and standing up too",
        True,
    ),
    "arm_raises": Group("arm raises", "of each arm, by shoulder elevation; a punch upwards is one too", True),
    "repetitions": Group("repetitions", "of the angle that `--set measures.repeat=ANGLE` names", True),
    "jumps": Group("jumps", "flights of the whole body", True),
    "off_keypoints": Group("limbs against their keypoints", "how far a limb is from its keypoints in the image"),
}  # fmt: skip

# Name, label, unit, who reads it, where its error comes from, definition; by the group that defines it.
_TABLE: dict[str, list[tuple[str, str, str, Audience, str, str]]] = {
    "range_of_motion": [
        ("p05", "5th percentile", "deg", "page", "angle", "One frame in twenty is below."),
        ("p95", "95th percentile", "deg", "page", "angle", "One frame in twenty is above."),
        ("p05_p95", "range", "deg", "page", "angle", "From the 5th to the 95th percentile of all frames of the take."),
        ("lowest", "lowest", "deg", "files", "angle", "The lowest value of a frame."),
        ("highest", "highest", "deg", "files", "angle", "The highest value of a frame."),
        ("full_range", "full range", "deg", "files", "unknown", "From the lowest to the highest value."),
        ("usual_error", "usual error", "deg", "files", "", "The median of the angle's stated standard deviations."),
        ("beyond_anatomy_frames", "frames beyond anatomy", "", "files", "", "Frames beyond what a joint reaches."),
        ("frames", "frames", "", "files", "", "Frames that have a value."),
        ("nan_share", "share without a value", "", "files", "", "Share of the frames that have none, 0 to 1."),
    ],
    "symmetry": [
        ("right", "right", "deg", "files", "angle", "The right side's range."),
        ("left", "left", "deg", "files", "angle", "The left side's range."),
        ("symmetry_index", "right minus left", "percent", "page", "sides",
         "Right minus left, divided by their mean: 0 % when equal, positive when the right is larger."),
    ],
    "walking": [
        ("steps", "steps", "", "first", "",
         "From one foot's initial contact to the other's; a walk has one contact more than it has steps."),
        ("cadence", "cadence", "spm", "first", "gait",
         "Steps a minute, by the mean step time. Adults who walk at ease: 100 to 120."),
        ("walking_speed", "speed", "speed", "first", "gait",
         "Distance that the pelvis moves between initial contacts, divided by time. Adults who walk at ease: 1.2 to "
         "1.4 m/s."),
        ("step_length", "step length", "length", "page", "gait",
         "From the other foot's place to this foot's, along the walk."),
        ("stride_length", "stride length", "length", "page", "gait",
         "From a foot's place to its next one, along the walk."),
        ("step_width", "step width", "length", "page", "gait",
         "Sideways distance of a foot from the middle of the other foot's places before and after it (Huxham et al. "
         "2006)."),
        ("step_time", "step time", "s", "page", "gait", "From one foot's initial contact to the other's."),
        ("stride_time", "stride time", "s", "page", "gait",
         "From a foot's initial contact to its next: one gait cycle (Hollman et al. 2011)."),
        ("stance_time", "stance time", "s", "page", "gait", "How long a foot is on the floor."),
        ("swing_time", "swing time", "s", "page", "gait", "How long a foot is in the air."),
        ("stance", "stance phase", "percent", "page", "gait",
         "Share of the gait cycle that the foot is on the floor; about 60 % in a walk at ease."),
        ("swing", "swing phase", "percent", "page", "gait", "Share of the gait cycle that the foot is in the air."),
        ("single_support", "single support", "percent", "page", "gait",
         "Share of the gait cycle in which only this foot is on the floor."),
        ("double_support", "double support", "percent", "page", "gait",
         "Share of the gait cycle in which both feet are on the floor; none in a run."),
        ("flight_time", "flight time", "s", "page", "gait", "How long both feet are in the air."),
        ("knee_at_contact", "knee flexion at initial contact", "deg", "page", "unchecked",
         "Knee flexion when the foot touches the floor (Benedetti et al. 1998)."),
        ("knee_loading_peak", "knee flexion, peak in loading response", "deg", "page", "unchecked",
         "The highest knee flexion in the first half of stance."),
        ("knee_swing_peak", "knee flexion, peak in swing", "deg", "page", "unchecked",
         "The highest knee flexion while the foot is in the air."),
        ("thigh_trunk_lowest", "hip flexion (thigh against trunk), lowest", "deg", "page", "unchecked",
         "The thigh's lowest flexion against the trunk in a stride; negative: behind the trunk."),
        ("walks", "walks or runs", "", "page", "",
         "At least three steps (two of a run) without a stop or a sharp turn."),
        ("walked", "time walked", "s", "page", "unknown",
         "From the first initial contact to the last, of all walks together."),
        ("steps_by_knees", "steps by the knees", "", "page", "",
         "Steps towards the camera or away from it are hard to see; these are recognised by the knees' rhythm. Means "
         "leave them out."),
        ("strides", "strides", "", "page", "", "From a foot's initial contact to its next."),
        ("belt_speed", "belt speed", "speed", "page", "gait", "Speed of the treadmill, by the feet that it carries."),
        ("gait", "gait", "text", "files", "",
         "`walking`, `running`, or `walking or running` where it is not known whether both feet were in the air."),
        ("not_visible", "not visible", "text", "page", "", "Which end of a walk was not visible."),
        ("landings", "initial contacts", "moments", "files", "", "When the foot first touches the floor."),
        ("toe_offs", "toe-offs", "moments", "files", "", "When the foot leaves the floor (Perry & Burnfield 2010)."),
        ("stride_start", "strides begin", "moments", "files", "", "When each stride begins: initial contact."),
        ("stride_stop", "strides end", "moments", "files", "",
         "When each stride ends: the next initial contact of the same foot, in the same walk."),
    ],
    "knee_bends": [  # and arm raises, and repetitions of any angle
        ("count", "count", "", "first", "",
         "Number in the whole take; a posture that is held for over 3 s is none."),
        ("squats", "squats", "", "first", "",
         "Knee bends in which the less bent knee reaches 70 degrees, beyond its error (Schoenfeld 2010)."),
        ("peak", "peak", "deg", "first", "angle", "The largest angle; in a knee bend that of the less bent knee."),
        ("peak_mdc90", "MDC90 from peak to peak", "deg", "page", "",
         "Equal peaks of one take differ by less than this in nine of ten cases."),
        ("rise", "rise", "deg", "page", "angle",
         "By how much the angle grows in this repetition alone: from where it last began to rise, not from the lowest "
         "angle before. Missing if a gap hides its start or end."),
        ("duration", "duration", "s", "page", "repeated",
         "From when the angle begins to rise until it is back at 7 % of the rise; missing if a gap hides either."),
        ("start", "start", "moments", "page", "", "When it begins."),
        ("stop", "stop", "moments", "page", "", "When it ends."),
        ("peak_at", "peak at", "moments", "page", "", "When the angle is largest."),
        ("observable", "could be judged", "percent", "page", "",
         "Share of the frames in which all joints that the movement needs are known."),
    ],
    "jumps": [
        ("height_by_flight_time", "height by flight time", "cm", "first", "flight",
         "From time in the air alone, as on a jump mat; too high if the person lands with bent legs."),
        ("jump_height", "jump height", "length", "page", "flight",
         "By how much the centre of mass rises after the feet have left the floor (Linthorne 2001)."),
        ("contact_time", "contact time", "s", "page", "flight",
         "How long the feet are on the floor before a jump that follows another within a second."),
        ("take_off_feet", "feet at take-off", "", "page", "", "On how many feet the person takes off."),
        ("landing_feet", "feet at landing", "", "page", "", "On how many feet the person lands."),
    ],
}  # fmt: skip
# Quantities of which files have the mean and the standard deviation, and those of which right and left are compared.
MEANS = (
    "step_length", "stride_length", "step_width", "step_time", "stride_time", "stance_time", "swing_time", "stance",
    "swing", "single_support", "double_support", "flight_time", "knee_at_contact", "knee_loading_peak",
    "knee_swing_peak", "thigh_trunk_lowest", "rise", "duration",
)  # fmt: skip
COMPARED = ("step_time", "stance_time", "step_length")
# What is withheld together.
TOGETHER = {"lengths": "lengths and speed", "timing": "times and phases", "sd": "standard deviations"}


def _catalogue() -> dict[str, Figure]:
    figures = {
        name: Figure(name, label, unit, group, audience, error, definition)
        for group, table in _TABLE.items()
        for name, label, unit, audience, error, definition in table
    }
    for name in MEANS:
        figure = figures[name]
        figures[f"mean_{name}"] = figure._replace(name=f"mean_{name}", label=f"mean {figure.label}")
        varies = f"Standard deviation of: {figure.definition[0].lower()}{figure.definition[1:]}"
        figures[f"sd_{name}"] = figure._replace(
            name=f"sd_{name}",
            label=f"SD of {figure.label}",
            audience="page",
            error="spread",
            definition=varies,
        )
    index = figures["symmetry_index"]
    for name in COMPARED:
        label = f"{figures[name].label}, {index.label}"
        figures[f"{name}_symmetry_index"] = index._replace(
            name=f"{name}_symmetry_index", label=label, group="walking", error="gait"
        )
    return figures


FIGURES = _catalogue()


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list figures`, each with three texts."""
    return [
        {"key": figure.key, "its error comes from": ERRORS[figure.error], "what it is": figure.definition}
        for figure in FIGURES.values()
    ]


# Why a figure, or all figures of a group, are not given: the text of the remark `withheld`, and what pages say of it.
WITHHELD = {
    "camera-moves": "the camera moves",
    "detector-unsure": "the detector is unsure of its joints",
    "error-too-large": "its error is too large",
    "error-unknown": "its error is not known",
    "few-frames": "too few frames have it",
    "few-strides": "too few strides",
    "few-values": "too few values",
    "frames-missing": "frames without a value may show more",
    "not-levelled": "the take is not levelled",
    "place-unknown": "where the person is in the room is not known",
    "range-too-small": "both ranges are too small",
    "side-missing": "one side has no range",
    "sides-doubtful": "left and right are doubtful",
    "sides-unlike": "one side was visible in less of the movement",
    "take-too-short": "the take is too short",
}

# Joints and angles whose names of the data do not say what they are; angles by their name without a side.
_LABELS = {
    "root": "pelvis",  # whose path it is
    "thigh_trunk_flexion": "hip flexion (thigh against trunk)",
    "thorax_pelvis_rotation": "trunk rotation (chest against pelvis)",
    "pelvis_obliquity": "pelvic obliquity",
    "trunk_lean_sagittal": "trunk lean forward",
    "trunk_lean_frontal": "trunk lean to the side",
    "thigh_sagittal": "thigh forward",
    "shank_sagittal": "shank forward",
    "upper_arm_sagittal": "upper arm forward",
}


def label_of(name: str) -> str:
    """Of a joint, an angle or a group of figures in words: `r_knee_flexion` is "right knee flexion"."""
    side = {"r_": "right ", "l_": "left "}.get(name[:2], "")
    plain = name[2:] if side else name
    title = GROUPS[plain].title if plain in GROUPS else plain.replace("_", " ")
    return side + _LABELS.get(plain, title)
