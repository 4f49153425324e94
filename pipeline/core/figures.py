"""The catalogue of figures: what each is called, in which unit, who it is for, what it is, and where its error comes
from.

Keys of files, labels of pages, sentences and `pcnet3d list figures` are made from it. A take has no figures but these
(Measures in measures.py). figures.toml has it; means, spreads and indices of right and left are added here.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Literal, NamedTuple

_TABLES = tomllib.loads(Path(__file__).with_name("figures.toml").read_text(encoding="utf-8"))

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

ERRORS: dict[str, str] = _TABLES["errors"]  # where a figure's error comes from


class Figure(NamedTuple):
    """One quantity. name: in keys, without its unit; label: in words, the clinical one first; unit: one of UNITS;
    group: one of GROUPS, in which it is defined; error: of ERRORS; definition: in a sentence; mean: whether files have
    its mean and its standard deviation."""

    name: str
    label: str
    unit: str
    group: str
    audience: Audience
    error: str
    definition: str
    mean: bool = False

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


GROUPS = {name: Group(**fields) for name, fields in _TABLES["groups"].items()}
# Why a figure, or all figures of a group, are not given: the text of the remark `withheld`, and what pages say of it.
WITHHELD: dict[str, str] = _TABLES["withheld"]
# Quantities of which right and left are compared.
COMPARED = ("step_time", "stance_time", "step_length")
# What is withheld together.
TOGETHER = {"lengths": "lengths and speed", "timing": "times and phases"}


def _catalogue() -> dict[str, Figure]:
    figures = {
        name: Figure(name=name, group=group, **fields)
        for group, defined in _TABLES["figures"].items()
        for name, fields in defined.items()
    }
    for figure in [each for each in figures.values() if each.mean]:
        mean, sd = f"mean_{figure.name}", f"sd_{figure.name}"
        figures[mean] = figure._replace(name=mean, label=f"mean {figure.label}", mean=False)
        varies = f"Standard deviation of: {figure.definition[0].lower()}{figure.definition[1:]}"
        figures[sd] = figures[mean]._replace(
            name=sd, label=f"SD of {figure.label}", audience="page", error="spread", definition=varies
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


def label_of(name: str) -> str:
    """Of a joint, an angle or a group of figures in words: `r_knee_flexion` is "right knee flexion"."""
    side = {"r_": "right ", "l_": "left "}.get(name[:2], "")
    plain = name[2:] if side else name
    title = GROUPS[plain].title if plain in GROUPS else plain.replace("_", " ")
    return side + _TABLES["labels"].get(plain, title)
