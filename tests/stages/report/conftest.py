"""A take to report on, a film, and a headless browser that opens a file and is asked about it."""

import itertools
import json
import os
import select
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from golden.films import film_of
from pcnet3d.adapters.video import read
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.angle_error.joint_noise import shipped_noise
from pcnet3d.pipeline import H36M17, IMAGE, Pipeline, PoseSequence, Take, Video
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.stages.angles import Angles
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")


class Browser:
    """Chromium over its debugging pipe (file descriptors 3 and 4, messages end with a zero byte)."""

    def __init__(self, program: str, profile: Path) -> None:
        import fcntl

        (to_read, self._write), (self._read, to_write) = os.pipe(), os.pipe()

        def place_pipes() -> None:
            beyond = fcntl.fcntl(to_write, fcntl.F_DUPFD, 5)  # so that it is not 3 itself
            os.dup2(to_read, 3)
            os.dup2(beyond, 4)

        flags = "--headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking"
        self._process = subprocess.Popen(
            [program, *flags.split(), "--remote-debugging-pipe", f"--user-data-dir={profile}", "about:blank"],
            preexec_fn=place_pipes,
            pass_fds=(3, 4),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        self._buffer, self._ids = b"", itertools.count(1)
        self.messages: list[dict[str, Any]] = []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        number = next(self._ids)
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if hasattr(self, "_session"):
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != number:
            self.messages.append(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._read], [], [], 60)
            part = os.read(self._read, 1 << 20) if ready else b""
            assert part, "the browser ended, or said nothing for a minute"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def open(self, path: Path, width: int = 1280) -> None:
        """Open the file in a window of that width and wait until it is loaded."""
        self.ask(
            "Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600
        )  # fmt: skip
        self.messages.clear()
        self.ask("Page.navigate", url=path.as_uri())
        while all(message.get("method") != "Page.loadEventFired" for message in self.messages):
            self.messages.append(self._next())

    def value(self, expression: str) -> Any:
        """Of a JavaScript expression in the page; the browser's own question, which no policy of the page forbids."""
        answer = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def press(self, key: str) -> None:
        for kind in ("rawKeyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=key)

    @property
    def complaints(self) -> list[str]:
        """What the page's console and log say."""
        return [
            json.dumps(message["params"])
            for message in self.messages
            if message.get("method")
            in ("Log.entryAdded", "Runtime.consoleAPICalled", "Runtime.exceptionThrown")
        ]

    @property
    def requested(self) -> list[str]:
        """Every address that was asked for, but for what the page itself holds."""
        return [
            message["params"]["request"]["url"]
            for message in self.messages
            if message.get("method") == "Network.requestWillBeSent"
            and not message["params"]["request"]["url"].startswith("data:")
        ]

    def close(self) -> None:
        os.close(self._write)
        os.close(self._read)
        self._process.terminate()
        self._process.wait()


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    program = next(filter(None, map(shutil.which, _NAMES)), None)
    if program is None or os.name != "posix":
        pytest.skip(f"no browser on PATH: looked for {', '.join(_NAMES)}")
    opened = Browser(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Callable[..., Browser]:
    """opened(html, width=1280): the browser with that page."""

    def open_page(content: str, width: int = 1280) -> Browser:
        path = tmp_path / "page.html"
        path.write_text(content, encoding="utf-8")
        browser.open(path, width)
        return browser

    return open_page


@pytest.fixture(scope="session")
def walk_take() -> Take:
    """The walker before a tilted camera, 2 s, rectified, with paths and angles, as by the built-in
    lifter; seven frames without a right arm."""
    walk = walker(seconds=2.0)
    camera = side_camera(walk)
    poses = camera_poses(walk, camera).with_(made_by=MadeBy("estimated", shipped_noise().lifter))
    joints = poses.joints.copy()
    joints[40:47, poses.layout.indices(("r_elbow", "r_wrist"))] = np.nan
    keypoints = PoseSequence(
        camera.project(walk.world), H36M17, IMAGE, time_s=walk.time_s, frame_index=np.arange(len(walk))
    )
    take = Take(name="walker", poses=poses.with_(joints=joints), keypoints=keypoints)
    return Pipeline((Rectify(rectifier="geometric"), Trajectories(), Angles()))(take)


@pytest.fixture(scope="session")
def film(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Video]:
    """film(frames=60, size=(640, 360)), a file of its own at each call: H.264 with B-frames, one key frame and uneven
    time stamps; a white square stands at column 10 x frame number (modulo the width less the square's)."""

    def make(frames: int = 60, size: tuple[int, int] = (640, 360)) -> Video:
        (width, height), images = size, []
        for i in range(frames):
            image = np.full((height, width, 3), 40, np.uint8)
            image[:16, 10 * i % (width - 16) :][:, :16] = 255
            images.append(image)
        stamps = np.cumsum(np.where(np.arange(frames) % 3, 33, 34)) - 34
        path = film_of(
            tmp_path_factory.mktemp("film") / "film.mp4", images, stamps, g=999, bf=2, preset="ultrafast"
        )
        return read(path)[0]

    return make
