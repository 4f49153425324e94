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
        getattr(module, "__file__", None) for name, module in sys.modules.items() if name[:7] == "pcnet3d"
    }
    own = [Path(file) for file in files if file and file.endswith(".py")]
    lines = {file.relative_to(ROOT).as_posix(): len(file.read_text("utf-8").splitlines()) for file in own}
    return {name: count for name, count in sorted(lines.items()) if not name.startswith("adapters/")}


def demo() -> set[str]:
    """Runs the demo, and says which functions are given its RunOptions, or what holds them."""
    from pcnet3d.pipeline.cli import main

    passed: set[str] = set()

    def called(frame: FrameType, event: str, arg: object) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(ROOT)):
            held = (vars(value) if hasattr(value, "__dict__") else {} for value in frame.f_locals.values())
            kinds = {type(value).__name__ for value in frame.f_locals.values()}
            if "RunOptions" in kinds | {
                type(value).__name__ for each in held for value in list(each.values())
            }:
                passed.add(f"{Path(code.co_filename).relative_to(ROOT).as_posix()}:{code.co_name}")

    with TemporaryDirectory() as folder, redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        sys.argv = ["pcnet3d", "demo", "-o", f"{folder}/demo"]
        sys.setprofile(called)
        try:
            main()
        except SystemExit as ended:
            if ended.code:
                raise
        finally:
            sys.setprofile(None)
    return passed


if __name__ == "__main__":
    modules = "--modules" in sys.argv
    functions, lines = demo(), loaded()
    if modules:
        print(*(f"{count:6} {name}" for name, count in lines.items()), sep="\n")
    rooms: Counter[str] = Counter()
    for name, count in lines.items():
        rooms["/".join(name.split("/")[:2]) if name.count("/") > 1 else name.partition("/")[0]] += count
    print(*(f"{count:6} {room}" for room, count in rooms.most_common(12)), sep="\n")
    print(f"{sum(lines.values()):6} lines in {len(lines)} modules are loaded by a demo run, adapters aside")
    print(f"{len(functions):6} functions are given its options: {', '.join(sorted(functions))}")
