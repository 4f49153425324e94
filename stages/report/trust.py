"""How far a take can be trusted: one gauge over the poses, up, left and right, and what was in view."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from markupsafe import Markup

from ...models.common.residuals import limb_scores
from ...pipeline.core.figures import label_of
from ...pipeline.core.measures import SD_90
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.notices import Notice, grave, verdict_name
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.take import Take
from ...pipeline.signals.angles import ANGLES
from ...pipeline.signals.checks import moves
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.visibility import SURE_SCORE
from ..angles import ANGLE_ERRORS
from ..drawing.facts import ERRORS_OF_ANGLES, Facts
from ..drawing.page import Level, gauge

# Degrees that up is known to within: below the first, angles to gravity err no more than a lift's joint angles do
# (5 to 7 degrees in standard deviation, docs/angles.md).
_WELL = 6.0
# Degrees that joint angles are known to within (90 %, median): less than a knee bends in the stance of a walk (15 to
# 20, Perry & Burnfield 2010), so that such a movement can be told.
_TOLD = 15.0
_WHOLE = 0.05  # share of the joints that may be missing "except for moments": one second in twenty
# Share of the frames in which one joint may: hands and elbows are missing in up to 12 % of walks, a foot that left the
# image in 22 %.
_ONE = 0.15
_MOSTLY = 0.5  # share of the frames that have all joints
_MOST = 5  # stretches that are told
_LIMBS = {f"{side[0]}_{limb}": f"{side} {limb}" for side in ("right", "left") for limb in ("leg", "arm")}
# Notices that leave the rate open, but for what a user says against the file.
_AGAINST_RATE = frozenset(("slow-motion-stated", "clocks-contradict", "rate-against-movement"))
_SIDES_WRONG = ("mirrored", "legs-against-arms", "left-and-right")
_SHOWS_FAULTS_S = 0.5  # of the take, in which an arm that is lost comes back
_LEVELS: tuple[Level, ...] = ("bad", "care", "good")
_TO_GRAVITY = "trunk lean, angles of thigh, shank and upper arm to the vertical, heights and paths"

Check = tuple[str, Level, list[str]]


def trust(take: Take, facts: Facts) -> Markup:
    """How far to trust the take: as far as its worst check allows."""
    checks = _poses(take)
    if take.verdict != "unusable":  # what else is known of such poses was never compared with a truth
        told = {text for _, _, texts in checks for text in texts}
        checks += [_up(facts), *_angles(take), _sides(take, told), _view(take)]
    checks += _others(take, {text for _, _, texts in checks for text in texts})
    level = _LEVELS[min(_LEVELS.index(level) for _, level, _ in checks)]
    without_errors = take.angle_errors == "none"
    verdict, reason = "Usable.", "The figures hold within their errors."
    if level == "bad":
        unusable = take.verdict == "unusable"
        verdict, reason = f"Do not rely on {'it' if unusable else 'directions, heights and paths'}.", ""
    elif take.verdict == "suspicious":
        verdict = "Check."
        reason = f"Some figures may be off{'' if without_errors else ' by more than their errors'}."
    elif _against_rate(take.said):
        reason = "Times and speeds hold only if the frame rate is right."
    elif without_errors:
        reason = "The errors of the angles are not known."
    elif level == "care":
        reason = ""
    marked = sum(how != "good" for _, how, _ in checks)
    points = f"{'point' if marked == 1 else f'{marked} points'} marked '!'"
    look = {"care": f"Look at the {points}.", "bad": "Look at what is marked.", "good": ""}[level]
    return gauge(level, verdict, " ".join(filter(None, [reason, look])), checks)


def _others(take: Take, texts_so_far: set[str]) -> list[Check]:
    """Warnings that no other check has told."""
    texts = [each.text for each in take.notices if each.warns and each.text not in texts_so_far]
    return [("Also", "care", texts)] if texts else []


def _against_rate(notices: Iterable[Notice]) -> list[Notice]:
    """Those by which the frame rate may be wrong, and with it all times and speeds."""
    return [each for each in notices if each.code in _AGAINST_RATE]


def _poses(take: Take) -> list[Check]:
    if take.verdict is None:
        return []
    level: Level = {"unusable": "bad", "suspicious": "care"}.get(take.verdict, "good")  # type: ignore[assignment]
    graver, poses = grave(take.judged), take.need("poses")
    doubts = [doubt.text for doubt in graver] or [_undoubted(poses)]
    if level == "good" and poses.duration_s < _SHOWS_FAULTS_S:
        level = "care"
        doubts.append("Less than half a second does not show faults that come and go.")
    doubts += [each.text for each in take.notices if each.about == "poses" and each.weight == "warning"]
    if against := [each.text for each in _against_rate(take.notices) if each.weight == "warning"]:
        level = "care" if level == "good" else level
        doubts += against
    name = verdict_name(take.judged).capitalize()
    if level == "good" and take.error_unknown:
        name, level = "How far the poses are off cannot be judged", "care"
    elif level == "good" and _whole(poses).mean() < _MOSTLY:
        name, level = "What was seen of the poses is good", "care"
    return [(name, level, doubts)]


def _whole(poses: PoseSequence) -> np.ndarray:
    """(T,) which frames have all joints."""
    return np.asarray(np.isfinite(poses.without_feet.joints).all(axis=(1, 2)))


def _undoubted(poses: PoseSequence) -> str:
    """A sentence about poses of which no check has doubts."""
    if _whole(poses).sum() < 2:
        return "No fault was found."
    return f"The body has steady bones{' and moves as people do' * moves(poses)}."


def _up(facts: Facts) -> Check:
    if not facts.rectified.level_ok:
        not_levelled = f"The take could not be levelled: {facts.rectified.level_reason}."
        return "Which way is up", "bad", [not_levelled, f"Do not believe {_TO_GRAVITY}."]
    if facts.up_of_world:
        weight = "care" if facts.up_bound_deg is None else "good"
        return "Which way is up", weight, [facts.up_words]
    up_words, rests = facts.up_words, f" {facts.rests_words}".rstrip()
    if facts.bound_words is None:
        return "Which way is up", "care", [f"{up_words} So {_TO_GRAVITY} are uncertain."]
    if facts.nobody_upright:
        return "Which way is up", "care", [f"{up_words} {facts.nobody_upright.text}{rests}"]
    if max(facts.up_bound_deg or (0.0,)) <= _WELL:
        return "Which way is up", "good", [up_words + rests]
    tilted = f"{_TO_GRAVITY[0].upper()}{_TO_GRAVITY[1:]} may be off by as much"
    others = "angles between segments, such as the knee's, do not depend on up"
    return "Which way is up", "care", [f"{up_words} {tilted}; {others}.{rests}"]


def _angles(take: Take) -> list[Check]:
    """How well joint angles are known; nothing of poses that were measured."""
    basis = [each.text for each in take.notices if each.code in ANGLE_ERRORS]
    columns = take.kinematics or {}
    sds = [columns[f"{name}_sd_deg"] for name in ANGLES if f"{name}_sd_deg" in columns]
    usual_sds = [float(np.nanmedian(sd)) for sd in sds if np.isfinite(sd).any()]
    if not usual_sds:
        return [("Joint angles", "care", basis)] if basis else []
    within = SD_90 * float(np.median(usual_sds))
    least, most = (f"{SD_90 * of(usual_sds):.0f}" for of in (min, max))
    each = least if least == most else f"{least} to {most}"
    how = f", {ERRORS_OF_ANGLES[take.angle_errors]}" if take.angle_errors else ""
    words = f"Mostly known to within {each}° (90 %), depending on the angle{how}."
    if within <= _TOLD:
        return [("Joint angles", "good", [words, *basis])]
    return [
        (
            "Joint angles",
            "care",
            [f"{words} Smaller movements and smaller differences between sides cannot be detected.", *basis],
        )
    ]


def _sides(take: Take, told: set[str]) -> Check:
    """told: texts of the poses' check, which are not written a second time."""
    about_sides = [each for each in take.notices if each.about == "left and right"]
    texts = [each.text for each in about_sides]
    wrong = any(finding.code in _SIDES_WRONG for finding in take.findings or ())
    warned = wrong or any(each.warns for each in about_sides)
    if texts or wrong:
        sentence = texts or ["Left and right are doubtful in the whole take; see the poses."]
        more = [text for text in sentence if text not in told] or ["See the poses."]
        return "Left and right", "care" if warned else "good", more
    if len(take.need("poses")) < 2:
        return "Left and right", "care", ["A single frame does not show whether limbs are exchanged."]
    limbs = take.figures.group("off_keypoints")
    off = [
        f"{sentence} from {spans_in_words(spans, _MOST)}"
        for name, sentence in _LIMBS.items()
        if (spans := limbs.group(name).spans)
    ]
    if not off:
        alone = take.keypoints is None and take.need("poses").frame.family == "camera"
        hidden = "; without 2D keypoints an exchange that the estimator smoothed is not seen" if alone else ""
        return "Left and right", "good", [f"No exchanged limbs were found{hidden}."]
    sentence = "No exchanged limbs were found, but some do not fit their keypoints"
    return "Left and right", "care", [f"{sentence}: {', '.join(off)}."]


def _view(take: Take) -> Check:
    texts = [each.text for each in take.notices if each.about == "view"]
    poses = take.need("poses").without_feet
    gone = np.isnan(poses.joints).any(axis=-1).mean(axis=0)
    missing, worst = float(gone.mean()), int(gone.argmax())
    sentence = f"{100 * missing:.0f} % of the joints are missing. " if missing >= 0.005 else ""
    sentence += _missing(take)
    level: Level = "good" if missing < _WHOLE and gone[worst] < _ONE else "care"
    if missing < _WHOLE and level == "care":
        joint = label_of(poses.layout.joints[worst])
        sentence += f" The {joint} is missing in {100 * gone[worst]:.0f} % of the frames."
    scores = limb_scores(take)
    shares = {
        name: float((scores[limb] < SURE_SCORE).any(axis=1).mean())
        for limb, name in _LIMBS.items()
        if limb in scores
    }
    if unsure := [f"the {name} in {100 * share:.0f} %" for name, share in shares.items() if share > _ONE]:
        texts.append(
            f"The detector is unsure of {', '.join(unsure)} of the frames, and may have guessed there; "
            "guessed joints do not count as missing."
        )
    if texts:
        return "In view", "care", [*texts, sentence]
    if take.keypoints is None:
        sentence += " Without 2D keypoints the page cannot say more."
    elif level == "good":
        in_sight = (
            "both arms and legs were seen, except for moments"
            if missing
            else "no limb was out of sight for long"
        )
        sentence = f"By the detector's scores {in_sight}. {sentence}"
    return "In view", level, [sentence]


def _missing(take: Take) -> str:
    """When joints are missing, in a sentence."""
    poses = take.need("poses")
    gone = ~_whole(poses)
    if not gone.any():
        filled = any(each.code == "gaps-filled" for each in take.notices)
        return f"Every frame has all joints{', some of them interpolated' if filled else ''}."
    spans = poses.times[stretches(gone) - np.array([0, 1])].tolist()
    return f"Some joints are missing from {spans_in_words(spans, _MOST)}."
