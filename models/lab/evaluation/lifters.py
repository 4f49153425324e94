"""Which of several lifters is better for people whom no network saw:  pcnet3d lab evaluate lifters A.onnx B.onnx -o DIR

Whole validation takes before virtual cameras, under three conditions. A person's value is the mean over frames of each
take, then over the person's takes, so that every person has one weight. Networks are compared person by person.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import numpy as np

from ....pipeline.core.errors import InputError
from ....pipeline.core.lifted import ToLift
from ....pipeline.core.pose import package_version
from ....pipeline.plugins.protocols import Lifter
from ....pipeline.running.progress import each
from ...lifter.load import load_lifter
from .lifter_takes import CONDITIONS, FIGURES, POSTURES, judge, materials
from .people import by_person, interval, mean, means
from .sets import Question
from .tables import Page, Table
from .testbed import BEDS

_BOTH = " and ".join(BEDS)  # views that are judged together too
_KEYS = ("condition", "posture", "views")
_OF = {key: f"{{{key}}}" for key in _KEYS}
_UNITS = {name: f"{name.removesuffix('_flexion')}, {unit}" for name, unit in FIGURES.items()}
PAGE = Page(
    "Lifters",
    "pcnet3d {pcnet3d}, seeds of cameras: {seeds}, whole validation takes. Every person has one weight; people: "
    "{people}. So few people stand for few others: intervals are rather too narrow. One scale a frame, velocity one a "
    "take; angles are RMSE, 6 Hz. "
    "Whether a network that was trained elsewhere saw these people nobody knows.",
    [
        Table(
            "Errors",
            "rows/*",
            [],
            {
                **_OF, "part": "{part}", "people": "{people}", "network": "{network}",
                **{_UNITS[name]: f"{{{name}:.1f}}" for name in FIGURES},
            },
        ),
        Table(
            "Differences",
            "differences/*",
            [],
            {
                **_OF, "people": "{people}", "less": "{networks[0]} less {networks[1]}",
                **{_UNITS[name]: f"{{{name}[mean]:+.1f}}" for name in FIGURES},
                **{
                    f"90 % of {_UNITS[name]}": f"{{{name}[low]:+.1f}} to {{{name}[high]:+.1f}}"
                    for name in FIGURES
                },
            },
            "The mean over people and its 90 % interval; negative errors: the first network is better.",
        ),
    ],
)  # fmt: skip

People = dict[str, dict[str, np.ndarray]]  # {part: {person: (F,) of FIGURES}}


def tables(
    question: Question, networks: Sequence[str], seeds: int = 3, part: Sequence[str] | None = None
) -> dict[str, Any]:
    """Everything the report says. networks: names of load_lifter. part: labels of the parts to judge; all without any.

    {"seeds", "networks": [method], "rows": [{"condition", "views", "posture", "part", "people", "network", FIGURES}],
    "differences": [{"condition", "views", "posture", "people", "networks": [A, B], figure: {"mean", "low", "high"}}],
    "people": {part: [person]}}; the differences are A less B, with a 90 % interval.
    InputError for a network that is no lifter, one that looks at images, one twice, and a part that there is not.
    """
    lifters = opened(networks)
    takes: dict[tuple[str, str, str, str], dict[str, list[tuple[str, np.ndarray]]]] = {
        key: {} for key in product(CONDITIONS, POSTURES, (*BEDS, _BOTH), lifters)
    }
    for material in materials(seeds, part or ()):
        words = f"{material.part}, {material.views}, seed {material.seed}"
        for take in each(material.takes(), words, len(material.clips)):
            for (network, lifter), (condition, given) in product(lifters.items(), take.inputs.items()):
                keypoints, focal_px = given
                poses = lifter.lift(ToLift(keypoints, take.seen.image_size, focal_px)).poses
                for (posture, figures), views in product(
                    judge(take.seen, poses).items(), (material.views, _BOTH)
                ):
                    of_part = takes[condition, posture, views, network].setdefault(material.part, [])
                    of_part.append((take.seen.subject, np.array(figures)))
    values = {
        key: {label: by_person(of) for label, of in parts.items()} for key, parts in takes.items() if parts
    }
    shown = {part: sorted(people) for parts in values.values() for part, people in parts.items()}
    return {
        "pcnet3d": package_version(),
        "seeds": seeds,
        "networks": list(lifters),
        "people": shown,
        "rows": [row for key, parts in values.items() for row in rows_of(key, parts)],
        "differences": [
            {
                **dict(zip(_KEYS, key, strict=True)), "networks": [one, other],
                **difference(values[*key, one], values[*key, other]),
            }
            for key in dict.fromkeys(key[:3] for key in values)
            for one, other in combinations(lifters, 2)
        ],
    }  # fmt: skip


def opened(names: Sequence[str]) -> dict[str, Lifter]:
    """{method: lifter}. InputError as of tables."""
    lifters: dict[str, Lifter] = {}
    for name in names:
        lifter = load_lifter(name)
        if "images" in lifter.takes:
            raise InputError(
                "option-conflict", f"{name} looks at images, which motion capture has none of; leave it out."
            )
        if lifter.method in lifters:
            raise InputError(
                "option-conflict", f"{name} is given twice, as {lifter.method}; give each network once."
            )
        lifters[lifter.method] = lifter
    return lifters


def rows_of(key: tuple[str, str, str, str], parts: People) -> list[dict[str, Any]]:
    """Means over people, each with one weight, of each part and, where there are several, of all."""
    groups = {part: list(people.values()) for part, people in parts.items()}
    if len(groups) > 1:
        groups["all"] = [person for people in groups.values() for person in people]
    of = dict(zip((*_KEYS, "network"), key, strict=True))
    return [
        {**of, "part": part, "people": len(people), **dict(zip(FIGURES, means(people).tolist(), strict=True))}
        for part, people in groups.items()
    ]


def difference(one: People, other: People) -> dict[str, Any]:
    """{"people", figure: {"mean", "low", "high"}} of one less other, person by person; low and high hold 90 % of the
    means of people drawn anew from these, NaN of a single one."""
    pairs = [
        people[person] - other[part][person]
        for part, people in one.items()
        for person in people
        if person in other.get(part, {})
    ]
    found: dict[str, Any] = {"people": len(pairs)}
    for figure, values in zip(FIGURES, np.array(pairs).reshape(-1, len(FIGURES)).T, strict=True):
        low, high = interval(values[np.isfinite(values)])
        found[figure] = {"mean": mean(values), "low": low, "high": high}
    return found
