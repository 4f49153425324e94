"""A take's own process: exits when its parent dies."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time

from ....pipeline.cli import main
from ....pipeline.system import terminate_self

_TO_TIDY_UP_S = 5.0


def _end_with_parent() -> None:
    """Wait for the end of stdin, which nobody writes to, then leave as on SIGTERM, or at once if that does not help."""
    while os.read(0, 4096):
        pass
    terminate_self()
    time.sleep(_TO_TIDY_UP_S)
    os._exit(128 + signal.SIGTERM)


if __name__ == "__main__":
    threading.Thread(target=_end_with_parent, daemon=True).start()
    sys.argv[0] = "pcnet3d"
    main()
