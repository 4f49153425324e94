"""Images of a video that only repeat the one before: of a padded frame rate, a recording that stalls, or a still."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...pipeline.files.detections import MOVES, Detections
from ...pipeline.signals.filters import stretches

# Changes are those of `Glance.change_to`, in grey values. Compressed repeats have up to a quarter of the change before
# and after them, images of real recordings two thirds and more. Where less than MOVES moves a
# repeat does no harm.
_SMALL = 0.25
_FEW = 4  # images that repeat in a row between others that move, as of 6 frames a second in 30
_BESIDE = 3  # images that move before and after more of them,
_LEAP = 1.1  # times as far as those after it: without a leap somebody stands still,
_HARDLY = 0.5  # and that much more than they themselves: a subtitle that comes and goes makes no still of what moves
# Grey values by which an image that is shown on changes, in the middle and at a key frame, where it stops and goes on
# from one image to the next; and in the middle where that is all there is, whose first images and key frames are up to
# MOVES sharper. A small person who stands changes them by 0.6, seen as large as usual by 2 and more.
_STILL, _SHARPER, _SAME = 1.5, MOVES / 2, 0.2


def repeated(change: np.ndarray) -> np.ndarray:
    """(R,) rows of images that repeat the one before. change: (T,) of each from the one before, NaN where unknown.

    Such an image differs much less from the one before than its neighbours do from theirs. Where many do so in a row
    the image goes on with a leap, for what happened meanwhile was not recorded.
    """
    repeats: list[int] = []
    run: list[int] = []
    before = np.nan  # change of the last image in front of the run
    for row, now in enumerate(change.tolist()):
        if now < _SMALL * before or (run and now < MOVES):
            run.append(row)
            continue
        if run and now >= MOVES <= before and change[run].max() < _SMALL * now and _halts(change, run):
            repeats += run
        run, before = [], now
    return np.union1d(np.array(repeats, np.int64), _frozen(change))


def _frozen(change: np.ndarray) -> np.ndarray:
    """(R,) rows of images that show the one before on: it stops and goes on at once, as nobody does, or the scene ends
    with it; of a scene that is a still all but the first."""
    still = [np.empty(0, np.int64)]
    for least, most in ((_SHARPER, _STILL), (MOVES, _SAME)):
        for first, stop in stretches(change < least).tolist():
            sides = change[max(first - _BESIDE, 0) : first][::-1], change[stop : stop + _BESIDE]
            # Beyond a cut is another scene.
            sides = [side for side in sides if len(side) and np.isfinite(side[0])]
            if bool(sides) == (most == _SAME) or not all((side >= MOVES).all() for side in sides):
                continue
            if stop - first > _FEW and np.median(change[first:stop]) < most:
                still.append(np.arange(first, stop))
    return np.concatenate(still)


def _halts(change: np.ndarray, run: list[int]) -> bool:
    """Whether the recording halts in these rows, not somebody in it."""
    if len(run) <= _FEW:
        return True
    earlier, later = change[: run[0]][-_BESIDE:], change[run[-1] + 2 :][:_BESIDE]
    least = max(MOVES, change[run].max() / _HARDLY)
    moves = all(
        len(side) == _BESIDE and (side >= MOVES).all() and np.median(side) > least
        for side in (earlier, later)
    )
    return moves and bool(change[run[-1] + 1] > _LEAP * np.median(later))


def without_repeats(detections: Detections) -> Detections:
    """The same with nobody in repeated images, which show where people were before. Over few of them in a row people
    are taken to move evenly: as gaps, those of a padded frame rate would be most of a take. Who is in one image alone,
    however long it is shown, is left there."""
    again = np.isin(detections.frame_index, detections.repeated)
    kept, moved = ~again, {"joints": detections.joints.copy(), "box": detections.box.copy()}
    for person in np.unique(detections.person[again]):
        of_person = np.flatnonzero(detections.person == person)
        single = of_person[~again[of_person]]
        if len(single) < 2:
            kept[of_person] = True
            continue
        frames = detections.frame_index[single]
        at = np.interp(detections.frame_index[of_person], frames, np.arange(len(single)))
        before, after = np.floor(at).astype(int), np.ceil(at).astype(int)
        few, part = frames[after] - frames[before] <= _FEW + 1, at - before
        kept[of_person] |= few & (part > 0)
        for name, values in moved.items():
            share = part.reshape(-1, *[1] * (values.ndim - 1))
            a, b = (getattr(detections, name)[single[beside]] for beside in (before, after))
            values[of_person] = (1 - share) * a + share * b
    rows = {name: getattr(detections, name) for name in ("frame_index", "time_s", "person", "confidence")}
    return replace(detections, **{name: values[kept] for name, values in (rows | moved).items()})
