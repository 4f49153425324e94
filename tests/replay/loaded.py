"""How much of the source a run loads: lines of this package's modules in sys.modules after `pcnet3d demo`, adapters
aside, and the functions that its options pass through from the command line to the stages.

    python tests/replay/loaded.py [--modules]
"""

from __future__ import annotations

import sys
from collections import Counter
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from types import FrameType

import pcnet3d

ROOT = Path(pcnet3d.__path__[0])


def loaded() -> dict[str, int]:
    """Lines of each loaded module of ours by its path, without those of adapters."""
    files = {
        getattr(module, "__file__", None)
        for name, module in sys.modules.items()
        if name.partition(".")[0] == "pcnet3d"
    }
    own = [Path(file) for file in files if file and file.endswith(".py")]
    lines = {file.relative_to(ROOT).as_posix(): len(file.read_text("utf-8").splitlines()) for file in own}
    return {name: count for name, count in sorted(lines.items()) if not name.startswith("adapters/")}


def functions_given_options(words: list[str]) -> set[str]:
    """Runs `pcnet3d WORDS`, and says which functions are given its RunOptions, or what holds them. SystemExit with what
    the command printed when it fails."""
    from pcnet3d.pipeline.cli import main

    passed: set[str] = set()

    def called(frame: FrameType, event: str, arg: object) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(ROOT)):
            values = list(frame.f_locals.values())
            values += [inner for value in values for inner in _held(value)]
            if any(type(value).__name__ == "RunOptions" for value in values):
                passed.add(f"{Path(code.co_filename).relative_to(ROOT).as_posix()}:{code.co_name}")

    printed = StringIO()
    with redirect_stdout(printed), redirect_stderr(printed):
        sys.argv = ["pcnet3d", *words]
        sys.setprofile(called)
        try:
            main()
        except SystemExit as ended:
            failed = ended.code
        else:
            failed = 0
        finally:
            sys.setprofile(None)
    if failed:
        sys.exit(f"{printed.getvalue()}pcnet3d {words[0]} ended with exit code {failed}")
    return passed


def _held(value: object) -> list[object]:
    """The attributes that an object has, without asking the object, which may do anything to answer or fail."""
    try:
        return list(object.__getattribute__(value, "__dict__").values())
    except AttributeError:
        return []


if __name__ == "__main__":
    with TemporaryDirectory() as folder:
        functions = functions_given_options(["demo", "-o", f"{folder}/demo"])
    lines = loaded()
    if "--modules" in sys.argv:
        print(*(f"{count:6} {name}" for name, count in lines.items()), sep="\n")
    rooms: Counter[str] = Counter()
    for name, count in lines.items():
        rooms["/".join(name.split("/")[:2]) if name.count("/") > 1 else name.partition("/")[0]] += count
    print(*(f"{count:6} {room}" for room, count in rooms.most_common(12)), sep="\n")
    print(f"{sum(lines.values()):6} lines in {len(lines)} modules are loaded by a demo run, adapters aside")
    print(f"{len(functions):6} functions are given its options: {', '.join(sorted(functions))}")
