"""How far a take can be trusted: one gauge over the poses, up, left and right, and what was in view."""

from __future__ import annotations

import numpy as np
from markupsafe import Markup

from ...models.common.residuals import limb_scores
from ...pipeline.core.figures import label_of
from ...pipeline.core.measures import SD_90
from ...pipeline.core.messages import spans_in_words
from ...pipeline.core.take import Take
from ...pipeline.running.sentences import (
    ERRORS_OF_ANGLES,
    POSES_ARE,
    judgement,
    poses_are,
    up_bound,
    up_rests_on,
    up_words,
)
from ...pipeline.signals.angles import ANGLES
from ...pipeline.signals.checks import nobody_upright
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.visibility import SURE_SCORE
from ..angles import THE_ANGLES
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
_MOST = 5  # stretches that are told
_LIMBS = {f"{side[0]}_{limb}": f"{side} {limb}" for side in ("right", "left") for limb in ("leg", "arm")}
# Notices that leave the rate open, but for what a user says against the file.
_AGAINST_RATE = frozenset(("slow-motion-stated", "clocks-contradict", "rate-against-movement"))
_WITHHELD = "figures-withheld"  # is what the page begins with
_SIDES_WRONG = ("mirrored", "legs-against-arms", "left-and-right")
_SHOWS_FAULTS_S = 0.5  # of the take, in which an arm that is lost comes back
_LEVELS: tuple[Level, ...] = ("bad", "care", "good")
_TO_GRAVITY = "trunk lean, angles of thigh, shank and upper arm to the vertical, heights and paths"

Check = tuple[str, Level, list[str]]


def trust(take: Take) -> Markup:
    """How far to trust the take: as far as its worst check allows."""
    checks = _poses(take)
    if take.verdict != "unusable":  # what else is known of such poses was never compared with a truth
        told = {text for _, _, texts in checks for text in texts}
        checks += [_up(take), *_angles(take), *_sides(take, told), _view(take)]
    told = {_WITHHELD, *(text for _, _, texts in checks for text in texts)}
    if others := [each.text for each in take.notices if each.warns and not {each.code, each.text} & told]:
        checks.append(("Also", "care", others))
    level = _LEVELS[min(_LEVELS.index(level) for _, level, _ in checks)]
    marked = sum(how != "good" for _, how, _ in checks)
    points = f"{'point' if marked == 1 else f'{marked} points'} marked '!'"
    look = {"care": f"Look at the {points}.", "bad": "Look at what is marked.", "good": ""}[level]
    word, reason = _conclusion(take, level)
    return gauge(level, word, f"{reason} {look}".strip(), checks)


def _conclusion(take: Take, level: Level) -> tuple[str, str]:
    """What to do with a take of that level, in a word or two, and why, in a sentence or none."""
    without_errors = take.angle_errors == "none"
    if level == "bad":
        what = "it" if take.verdict == "unusable" else "directions, heights and paths"
        return f"Do not rely on {what}.", ""
    if take.verdict == "suspicious":
        return "Check.", f"Some figures may be off{' by more than their errors' * (not without_errors)}."
    word = "Check." if judgement(take) == "error-unknown" else "Usable."
    if any(each.code in _AGAINST_RATE for each in take.said):
        return word, "Times and speeds hold only if the frame rate is right."
    if without_errors:
        return word, "The errors of the angles are not known."
    return word, "Nothing speaks against the figures and their errors." * (level == "good")


def _poses(take: Take) -> list[Check]:
    code = judgement(take)
    if code is None:
        return []
    texts = poses_are(take)[1:]
    level: Level = "bad" if code == "unusable" else "good" if code == "good" else "care"
    if take.verdict == "good" and take.need("poses").duration_s < _SHOWS_FAULTS_S:
        level = "care"
        texts.append("Less than half a second does not show faults that come and go.")
    return [(POSES_ARE[code], level, texts)]


def _up(take: Take) -> Check:
    rectified, name, texts = take.need("rectified"), "Which way is up", [up_words(take)]
    bound = up_bound(rectified)
    if not rectified.level_ok:
        return name, "bad", [*texts, f"Do not believe {_TO_GRAVITY}."]
    if rectified.in_world:
        return name, "care" if bound is None else "good", texts
    if bound is None:
        return name, "care", [f"{texts[0]} So {_TO_GRAVITY} are uncertain."]
    rests = up_rests_on(rectified)
    if turned := nobody_upright(rectified):
        return name, "care", [*texts, turned[0].text, rests]
    if bound[1] <= _WELL:
        return name, "good", [*texts, rests]
    tilted = f"{_TO_GRAVITY[0].upper()}{_TO_GRAVITY[1:]} may be off by as much"
    others = "angles between segments, such as the knee's, do not depend on up"
    return name, "care", [*texts, rests, f"{tilted}; {others}."]


def _angles(take: Take) -> list[Check]:
    """How well joint angles are known; nothing of poses that were measured."""
    unknown = [each for each in take.notices if each.code == "errors-unknown"]
    basis = [each.text for each in unknown if each.values["what"] == THE_ANGLES]
    columns = take.kinematics or {}
    sds = [columns[f"{name}_sd_deg"] for name in ANGLES if f"{name}_sd_deg" in columns]
    usual_sds = [float(np.nanmedian(sd)) for sd in sds if np.isfinite(sd).any()]
    if not usual_sds:
        return [("Joint angles", "care", basis)] if basis else []
    within = SD_90 * float(np.median(usual_sds))
    least, most = (f"{SD_90 * end(usual_sds):.0f}" for end in (min, max))
    each = least if least == most else f"{least} to {most}"
    how = f", {ERRORS_OF_ANGLES[take.angle_errors]}" if take.angle_errors else ""
    texts = [f"Mostly known to within {each}° (90 %), depending on the angle{how}."]
    if within > _TOLD:
        texts.append("Smaller movements and smaller differences between sides cannot be detected.")
    return [("Joint angles", "care" if texts[1:] else "good", [*texts, *basis])]


def _sides(take: Take, told: set[str]) -> list[Check]:
    """What is said of left and right, if anything is. told: texts of the poses' check, which are not written a second
    time."""
    about_sides = [each for each in take.notices if each.about == "left and right"]
    texts = [each.text for each in about_sides]
    wrong = any(finding.code in _SIDES_WRONG for finding in take.findings or ())
    warned = wrong or any(each.warns for each in about_sides)
    if texts or wrong:
        more = [text for text in texts if text not in told] or ["See the poses."]
        return [("Left and right", "care" if warned else "good", more)]
    limbs = take.figures.group("off_keypoints")
    off = [
        f"{limb} from {spans_in_words(spans, _MOST)}"
        for name, limb in _LIMBS.items()
        if (spans := limbs.group(name).spans)
    ]
    return (
        [("Left and right", "care", [f"Limbs do not fit their keypoints: {', '.join(off)}."])] if off else []
    )


def _view(take: Take) -> Check:
    texts = [each.text for each in take.notices if each.about == "view"]
    poses = take.need("poses").without_feet
    gone = np.isnan(poses.joints).any(axis=-1).mean(axis=0)
    missing, worst = float(gone.mean()), int(gone.argmax())
    level: Level = "good" if missing < _WHOLE and gone[worst] < _ONE else "care"
    sentence = _missing(take, missing)
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
    return "In view", "care" if texts else level, [*texts, sentence]


def _missing(take: Take, share: float) -> str:
    """How many joints are missing and when, in a sentence. share: of the joints, in all frames."""
    poses = take.need("poses")
    gone = np.asarray(np.isnan(poses.without_feet.joints).any(axis=(1, 2)))
    if not gone.any():
        filled = any(each.code == "gaps-filled" for each in take.notices)
        return f"Every frame has all joints{', some of them interpolated' * filled}."
    spans = poses.times[stretches(gone) - np.array([0, 1])].tolist()
    what = f"{100 * share:.0f} % of the joints" if share >= 0.005 else "Some joints"
    return f"{what} are missing, from {spans_in_words(spans, _MOST)}."
