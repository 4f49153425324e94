"""How an image differs from the one before; where a video goes on with another scene, and which of its images only
repeat the one before: of a padded frame rate, a recording that stalls, or a still. And leaps of what is seen: cuts
within a scene, where images were taken out or the picture enlarged, and rows of one track at which somebody else goes
on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...pipeline.files.detections import MOVES, Detections
from ...pipeline.reading.people import LARGER, extent, steps
from ...pipeline.signals.filters import stretches
from ...pipeline.signals.visibility import LEAST_SCORE

_SIDE = 32
_LONGER = 160  # pixels of the longer side that are kept
_MOST = 0.01  # of the pixels, whose change counts: a person is small in an image, and light and noise are everywhere
_ALIKE = 0.6  # correlation of two small images below which they show different scenes
_SAME = 8.0  # grey values by which what stays where it is differs from one image to a later one at most
_STAYS = 0.5  # of the image: who walks through a room, or comes near, leaves more of it as it was
_FLAT = 2.0  # deviation of grey values below which an image shows nothing to compare
# Grey value that no pixel of a black bar exceeds, and share of the side that bars leave at least: 0.32 beside a phone's
# upright video. With bars of an eighth above and below one cut in twelve was found, now all 360.
_BLACK, _LEAST = 24, 0.25
# Patches of an image, of so much of its shorter side, that are found again in the next: where five of 24 went the same
# way, by more than _BESIDE of the kept pixels, the camera turns. Of 1759 cuts between real videos, also with bars or a
# caption, which stays, four patches go alike at most; past a near post, by 5 to 25 % of the width a frame, most do.
# Where a film goes on mirrored, or of who stands alike, up to half of them are found at their place.
_PATCH, _ROWS, _COLUMNS, _FOUND, _BESIDE, _FEWEST, _HALF = 0.3, 4, 6, 0.7, 3, 5, 0.5
# So far leaps an image that shows much the same after a cut, against each of the last ten; and so much of it
# becomes lighter, and so much darker: a lamp or a flash, which may dazzle, does the one or the other.
_TIMES, _BOTH = 3.0, 0.1
# Of the longer side: no camera turns further between two images, but an editor shifts a picture.
_FARTHEST = 0.3
# Changes are those of `Glance.change_to`, in grey values. Compressed repeats have up to a quarter of the change before
# and after them, images of real recordings two thirds and more. Where less than MOVES moves a
# repeat does no harm.
_SMALL = 0.25
_FEW = 4  # images that repeat in a row between others that move, as of 6 frames a second in 30
_AROUND = 3  # images that move before and after more of them,
_LEAP = 1.1  # times as far as those after it: without a leap somebody stands still,
_HARDLY = 0.5  # and that much more than they themselves: a subtitle that comes and goes makes no still of what moves
# Grey values by which an image that is shown on changes, in the middle and at a key frame, where it stops and goes on
# from one image to the next; and in the middle where that is all there is, whose first images and key frames are up to
# MOVES sharper. A small person who stands changes them by 0.6, seen as large as usual by 2 and more.
_STILL, _SHARPER, _UNCHANGED = 1.5, MOVES / 2, 0.2

# Joints and image change this many times as much as in each of the images beside, and joints move by that much of the
# body's size. Where two seconds were cut out, or the picture was enlarged 1.3 times, both changed 3 times as much or
# more; in ninety other clips, films among them, never 1.6 times.
_AS_MUCH, _ON_EITHER_SIDE, _LEAPS = 2.0, 3, 0.04
# Somebody else goes on where joints move by so much of the body's size from one frame to the next, or farther by so
# much a second that nobody is seen, and then stay: so far from where they were going, or LARGER times larger or
# smaller, by medians over so long before and after, or over _PATH frames where these last longer.
_STEP, _A_SECOND, _FRAME_S = 0.12, 2.5, 1 / 30
_ELSEWHERE, _NEAR_S = 0.15, 0.25
_PATH = 4  # frames that show where somebody was going
_FEWEST_JOINTS = 3  # joints that tell how far a body has moved


class Glance:
    """What is kept of an image to compare it with the next.

    grey: (H, W) uint8 grey values, of at most 160 pixels a side. shows: whether there is anything in it.
    """

    def __init__(self, grey: np.ndarray) -> None:
        import cv2

        self.grey = grey
        self._small = cv2.resize(grey, (_SIDE, _SIDE), interpolation=cv2.INTER_AREA)
        self.shows = float(self._small.std()) > _FLAT

    @classmethod
    def at(cls, image: np.ndarray) -> Glance:
        """At an image (H, W, 3) uint8."""
        import cv2

        scale = min(_LONGER / max(image.shape[:2]), 1.0)
        height, width = (max(round(scale * side), 1) for side in image.shape[:2])
        # Four samples for each pixel: averaging all of them would cost more than what follows.
        samples = cv2.resize(image, (2 * width, 2 * height), interpolation=cv2.INTER_NEAREST)
        small = cv2.resize(samples, (width, height), interpolation=cv2.INTER_AREA)
        return cls(cv2.cvtColor(small, cv2.COLOR_RGB2GRAY))

    def is_cut_to(self, now: Glance, before: float = np.nan) -> bool:
        """Whether the next image shows another scene. Brighter, darker or a flash is none; nor is an image of one
        colour, so the caller keeps the last that `shows` something. before: the largest `change_to` of the last images,
        NaN where unknown: a scene much like the one before, such as its mirror image, is told by the leap."""
        if not (self.shows and now.shows):
            return False
        earlier, later = self._without_bars(now)
        patterns = [(each - each.mean()) / max(each.std(), _FLAT) for each in (earlier, later)]
        if float((np.abs(earlier - later) < _SAME).mean()) >= _STAYS:
            return False
        if float((patterns[0] * patterns[1]).mean()) >= _ALIKE:
            change, went = self.change_to(now), later - earlier
            of_light = min((went > _SAME).mean(), (went < -_SAME).mean()) < _BOTH
            if of_light or not (change >= MOVES and change >= _TIMES * before):
                return False
        return not self._stays_at(now)

    def _without_bars(self, now: Glance) -> tuple[np.ndarray, np.ndarray]:
        """Both small images without the bars that both have: these are alike in all scenes."""
        lit = np.maximum(self._small, now._small) > _BLACK
        window = []
        for axis in (1, 0):
            among = np.flatnonzero(lit.any(axis=axis))
            first, last = (int(among[0]), int(among[-1])) if len(among) else (0, 0)
            side = slice(first + (first > 0), last + (last == _SIDE - 1))  # less a bar's own edge
            window.append(side if side.stop - side.start >= _LEAST * _SIDE else slice(None))
        earlier, later = (each[tuple(window)].astype(np.float32) for each in (self._small, now._small))
        return earlier, later

    def _stays_at(self, now: Glance) -> bool:
        """Whether the next image shows the same, from a camera that stands or has turned, also past something near."""
        import cv2

        if self.grey.shape != now.grey.shape:
            return False
        height, width = self.grey.shape
        side, went, patches = max(round(_PATCH * min(height, width)), 1), list[tuple[int, int]](), 0
        for top in np.linspace(0, height - side, _ROWS).round().astype(int).tolist():
            for left in np.linspace(0, width - side, _COLUMNS).round().astype(int).tolist():
                patch = self.grey[top : top + side, left : left + side]
                if patch.std() > 2 * _FLAT:
                    patches += 1
                    alike = cv2.matchTemplate(now.grey, patch, cv2.TM_CCOEFF_NORMED)
                    _, best, _, (x, y) = cv2.minMaxLoc(alike)
                    went += [(x - left, y - top)] * (best >= _FOUND)
        ways = np.array(went).reshape(-1, 2)
        near = np.abs(ways[:, None] - ways).max(axis=-1) <= _BESIDE
        far = np.abs(ways).max(axis=-1, initial=0)
        moved = (far > _BESIDE) & (far <= _FARTHEST * max(height, width))
        turned = near[np.ix_(moved, moved)].sum(axis=1).max(initial=0)  # less who moves a little: the person
        return bool(turned >= _FEWEST or near.sum(axis=1).max(initial=0) > _HALF * patches)

    def change_to(self, now: Glance) -> float:
        """Grey values by which the hundredth of the pixels that changes most differs in the next image, on average; NaN
        for an image of another shape."""
        if self.grey.shape != now.grey.shape:
            return float("nan")
        change = np.abs(self.grey.astype(np.int16) - now.grey).ravel()
        most = max(round(_MOST * len(change)), 1)
        return float(np.partition(change, -most)[-most:].mean())


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
    for least, most in ((_SHARPER, _STILL), (MOVES, _UNCHANGED)):
        for first, stop in stretches(change < least).tolist():
            sides = change[max(first - _AROUND, 0) : first][::-1], change[stop : stop + _AROUND]
            # Beyond a cut is another scene.
            sides = [side for side in sides if len(side) and np.isfinite(side[0])]
            if bool(sides) == (most == _UNCHANGED) or not all((side >= MOVES).all() for side in sides):
                continue
            if stop - first > _FEW and np.median(change[first:stop]) < most:
                still.append(np.arange(first, stop))
    return np.concatenate(still)


def _halts(change: np.ndarray, run: list[int]) -> bool:
    """Whether the recording halts in these rows, not somebody in it."""
    if len(run) <= _FEW:
        return True
    earlier, later = change[: run[0]][-_AROUND:], change[run[-1] + 2 :][:_AROUND]
    least = max(MOVES, change[run].max() / _HARDLY)
    moves = all(
        len(side) == _AROUND and (side >= MOVES).all() and np.median(side) > least
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


def leaps(detections: Detections) -> np.ndarray:
    """(L,) frames at which somebody and the image leap, and neither before nor after it."""
    frames = set[int]()
    change = detections.change.astype(np.float64)
    change[detections.repeated] = np.nan
    visible = np.where((detections.confidence < LEAST_SCORE)[..., None], np.nan, detections.joints).astype(
        np.float64
    )
    for person in np.unique(detections.person):
        rows = np.flatnonzero(detections.person == person)
        if len(rows) <= 2 * _ON_EITHER_SIDE + 1:
            continue
        at = detections.frame_index[rows[1:]]
        went = np.where(np.diff(detections.frame_index[rows]) == 1, steps(visible[rows]), np.nan)
        large = (went >= np.maximum(_LEAPS, _AS_MUCH * _beside(went))) & (
            change[at] >= np.maximum(MOVES, _AS_MUCH * _beside(change[at]))
        )
        frames |= set(at[large].tolist())
    return np.array(sorted(frames), np.int64)


def _beside(values: np.ndarray) -> np.ndarray:
    """(T,) the largest of the three values on either side of each of (T,); NaN where one of them is not known."""
    result = np.full(len(values), np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(values, 2 * _ON_EITHER_SIDE + 1)
    result[_ON_EITHER_SIDE:-_ON_EITHER_SIDE] = np.delete(windows, _ON_EITHER_SIDE, axis=1).max(axis=1)
    return result


def exchanges(time_s: np.ndarray, points: np.ndarray) -> list[tuple[int, float]]:
    """Rows of one track at which somebody else goes on, and how far away in body sizes: of people who cross, a detector
    may follow the other one. time_s: (T,) increasing. points: (T, J, 2), NaN where missing. A cut within a scene is the
    same to it."""
    somebody = np.flatnonzero(np.isfinite(points).any(axis=(1, 2)))
    time_s, points = time_s[somebody], points[somebody]
    went = steps(points)
    wander = _A_SECOND * np.maximum(np.diff(time_s) - _FRAME_S, 0)
    rows = np.flatnonzero(went > _STEP + wander) + 1
    starts, stops = np.searchsorted(time_s, (time_s[rows - 1] - _NEAR_S, time_s[rows] + _NEAR_S))
    # At ten frames a second as many as show where somebody was going.
    starts = np.minimum(starts, np.maximum(rows - _PATH, 0))
    stops = np.maximum(stops, np.minimum(rows + _PATH, len(points)))
    rows_of_others = []
    for row, start, stop in zip(rows.tolist(), starts.tolist(), stops.tolist(), strict=True):
        parts = slice(start, row), slice(row, stop)
        # Joints seen throughout: by others the same body would be larger, and elsewhere.
        both = np.isfinite(points[start:stop]).all(axis=(0, 2))
        both |= both.sum() < _FEWEST_JOINTS
        bodies = [points[part][:, both] for part in parts]
        before, after = (float(np.nanmedian(extent(body))) for body in bodies)
        off = 0.0
        if min(row - start, stop - row) >= _PATH:
            at_s = float(time_s[row - 1] + time_s[row]) / 2
            was, goes_on = (
                _on_path(time_s[part], np.nanmean(body, axis=1), at_s)
                for part, body in zip(parts, bodies, strict=True)
            )
            off = float(np.linalg.norm(goes_on - was))
        larger, smaller = max(before, after), min(before, after)
        if larger > LARGER * smaller or off > (_ELSEWHERE + wander[row - 1]) * larger:
            rows_of_others.append((int(somebody[row]), float(went[row - 1])))
    return rows_of_others


def _on_path(time_s: np.ndarray, points: np.ndarray, at_s: float) -> np.ndarray:
    """(2,) where points (T, 2) are at a moment by the line through them, of medians (Theil 1950)."""
    first, last = np.triu_indices(len(points), 1)
    speed = np.nanmedian((points[last] - points[first]) / (time_s[last] - time_s[first])[:, None], axis=0)
    return np.nanmedian(points + speed * (at_s - time_s)[:, None], axis=0)
