"""The recording of a comparison: all skeletons in one LEVEL, and every angle of all, on the first run's clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ....pipeline.files.atomic import whole_file
from ...drawing.palette import GREEN, PURPLE, YELLOW, Colour
from ...drawing.rerun_file import recording_file
from ...drawing.rerun_log import half_height, log_curves, log_skeleton
from .comparison import Comparison
from .side import as_poses

# In the runs' order; none is the colour of a body's side.
COLOURS = (GREEN, PURPLE, YELLOW, (150, 75, 60), (120, 90, 200))
_REFERENCE: Colour = (200, 200, 200)  # on the viewer's dark ground
_SHOWN = ("r_knee_flexion", "l_knee_flexion", "r_elbow_flexion", "l_elbow_flexion", "trunk_lean_sagittal")


def write_recording(comparison: Comparison, words: str, path: Path) -> None:
    """Entities: level/<i> (skeletons: bones tell the sides of the comparison apart, joints left and right),
    angles/<angle>/<i>, the reference being 0, and summary. What lies outside the first run's time is left out."""
    import rerun as rr
    import rerun.blueprint as rrb

    reference = comparison.reference
    sides = [(reference, reference.level, 0.0, _REFERENCE)]
    for pair, colour in zip(comparison.pairs, COLOURS, strict=False):
        # Takes of different motions begin together.
        begins_s = float(reference.time_s[0] - pair.side.time_s[0])
        shift_s = begins_s if pair.alignment is None else pair.alignment.shift_s
        sides.append((pair.side, pair.level, shift_s, colour))
    clock, _, clock_shift, _ = sides[0] if reference.run else sides[1]
    angles = list(dict.fromkeys([*(name for pair in comparison.pairs for name in pair.agreement), *_SHOWN]))
    views = [
        rrb.TimeSeriesView(origin=f"angles/{name}", name=f"{name} (deg)")
        for name in [*_SHOWN, *(name for name in angles if name not in _SHOWN)]
    ]
    eye = half_height(reference.level) * np.array([-2.2, 1.1, 0.5])  # in front, right, a little above
    shown = rrb.Horizontal(
        rrb.Spatial3DView(
            origin="level",
            name=f"LEVEL: {', '.join(side.name for side, *_ in sides)}",
            eye_controls=rrb.EyeControls3D(position=eye, look_target=(0, 0, 0)),
        ),
        rrb.Vertical(*views[: len(_SHOWN)]),
        rrb.Vertical(
            rrb.Tabs(*views[len(_SHOWN) :]) if len(views) > len(_SHOWN) else views[0],
            rrb.TextDocumentView(origin="summary", name="Comparison"),
        ),
    )
    with whole_file(path) as partial, recording_file(partial, shown, path) as file:
        recording = file.stream
        recording.send_recording_name(" and ".join(side.name for side, *_ in sides))
        for i, (side, joints, shift, colour) in enumerate(sides):
            times = clock.time_s + clock_shift - shift
            poses = as_poses(side, side.joints_at(times, joints), clock.time_s, clock.frame_index)
            entity = f"level/{i}"
            log_skeleton(recording, entity, poses, radius=0.024 * half_height(joints))
            recording.log(f"{entity}/bones", rr.LineStrips3D.from_fields(colors=[colour]), static=True)
            for name in angles:
                values = side.at(name, times)
                log_curves(recording, f"angles/{name}/{i}", poses, values, [side.name], [colour])
        recording.log(
            "summary", rr.TextDocument(f"```\n{words}\n```", media_type=rr.MediaType.MARKDOWN), static=True
        )
