"""The catalogue of figures: what each is called, in which unit, who it is for, what it is, and where its error comes
from.

Keys of files, labels of pages, sentences and `pcnet3d list figures` are made from it. A take has no figures but these
(Measures in measures.py). figures.toml has each quantity; its means, spreads and indices of right and left follow here.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
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
    groups = tomllib.loads(Path(__file__).with_name("figures.toml").read_text(encoding="utf-8"))
    figures = {
        name: Figure(name=name, group=group, **fields)
        for group, defined in groups.items()
        for name, fields in defined.items()
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
