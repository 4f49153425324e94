"""paths.json: the joints' paths in LEVEL by name, and their times; a missing point is null."""

import json
from pathlib import Path

from pcnet3d.pipeline import Take, whole_file

file = "paths.json"
what = "times, and the joints' paths in LEVEL by name, as JSON"


def write(take: Take, path: Path) -> None:
    assert take.rectified is not None  # the stage export needs it, and calls this
    level = take.rectified.level
    paths = {
        name: [None if x != x else [x, y, z] for x, y, z in level.joint(name).tolist()]
        for name in level.layout.joints
    }
    content = {"unit": level.frame.unit, "time_s": level.times.tolist(), "paths": paths}
    with whole_file(path) as partial:
        partial.write_text(json.dumps(content, allow_nan=False), encoding="utf-8")
