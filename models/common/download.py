"""Networks of others that go by a name: downloaded when they are first asked for, once, and checked by their SHA-256.

The digests are those of the .onnx files as they lie at these addresses, or in the archives there (end2end.onnx). They
were taken from the files.
"""

from __future__ import annotations

import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...pipeline.core.errors import InputError
from ...pipeline.core.messages import say

_FOLDER = "pcnet3d"  # in the user's cache
_SECONDS = 30  # without an answer, until a download is given up


@dataclass(frozen=True)
class Network:
    """A model (pipeline.plugins.protocols.Model) that opens as its .onnx file. url: of the .onnx file or of a .zip that
    holds one. sha256, megabytes: of the .onnx file. licence: shown before a download. given: how a file of the user's
    own takes its place."""

    name: str
    about: str
    url: str
    sha256: str
    megabytes: float
    licence: str
    given: str = "--detector FILE.onnx"

    @property
    def path(self) -> Path:
        """Where the file lies, or is to be put by hand."""
        import pooch

        return Path(pooch.os_cache(_FOLDER)) / f"{self.name}.onnx"

    @property
    def is_there(self) -> bool:
        """Whether a file lies there; `open` checks that it is the right one."""
        return self.path.is_file()

    @property
    def what(self) -> str:
        """One line for `pcnet3d list models`."""
        there = "downloaded" if self.is_there else "downloaded when first used"
        return f"{self.about}; {self.licence} ({self.megabytes} MB, {self.sha256[:12]}, {there})"

    def open(self) -> Path:
        """The file, downloaded unless it is there. InputError in words when it cannot be had or is another file."""
        import pooch
        from requests.exceptions import RequestException

        digest = f"sha256:{self.sha256}"
        if not (self.is_there and pooch.hashes.hash_matches(str(self.path), digest)):
            said = f"downloading {self.name}, {self.megabytes} MB, from {self.url}; licence: {self.licence}"
            say("note", said)
        pooch.get_logger().setLevel("WARNING")
        downloader: Any = _download_onnx  # pooch's own type of these is that of processors
        try:
            return Path(
                pooch.retrieve(
                    self.url, digest, fname=self.path.name, path=self.path.parent, downloader=downloader
                )
            )
        except (RequestException, OSError, ValueError, zipfile.BadZipFile) as error:
            reason = "it is another file" if isinstance(error, ValueError) else type(error).__name__
            raise InputError(
                "not-reached",
                f"The network '{self.name}' could not be downloaded from {self.url} ({reason}); get it elsewhere and "
                f"put it at {self.path} (.onnx file, SHA-256 {self.sha256}), or give a file of your own with "
                f"{self.given}.",
            ) from None


_OPENMMLAB = "https://download.openmmlab.com/mmpose/v1/projects/rtmposev1/onnx_sdk"
_MODEL_HUB = "https://huggingface.co/Xenova"
MOVENET = Network(
    "movenet",
    "MoveNet Lightning, one person, 17 joints; used unless told otherwise",
    f"{_MODEL_HUB}/movenet-singlepose-lightning/resolve/ed0f314bb7356fd1dbf1e4f52c2d40791bf6534f/onnx/model.onnx",
    "1ad4f8d6c2f776a9967db3993c9ca740bc350104f9d37c151dc183fc29a464ad",
    9.4,
    "Apache-2.0",
)
MOVENET_THUNDER = Network(
    "movenet-thunder",
    "MoveNet Thunder, one person, 17 joints; slower and better",
    f"{_MODEL_HUB}/movenet-singlepose-thunder/resolve/38296077a99667cdad67af5096ce7eeb9b327453/onnx/model.onnx",
    "3dca9f6e5f8a64dc9935a5be06fd8bf81bf01e696c9c05c6f2a650e0a401b763",
    25.1,
    "Apache-2.0",
)
RTMPOSE = Network(
    "rtmpose",
    "RTMPose-m, 26 joints (Halpe); several people with --set detect.person_detector=yolox",
    f"{_OPENMMLAB}/rtmpose-m_simcc-body7_pt-body7-halpe26_700e-256x192-4d3e73dd_20230605.zip",
    "26f3a19e61304a600dfb82d1001d41d24343b89fc70a33ffc84657e0b0bf2ecf",
    55.7,
    "Apache-2.0 (MMPose), trained on data sets with terms of their own",
)
YOLOX = Network(
    "yolox",
    "YOLOX-tiny, boxes around people",
    f"{_OPENMMLAB}/yolox_tiny_8xb8-300e_humanart-6f3252f9.zip",
    "ceb11c07298f95c50d7c5abeb906d03340c85f23aa79e3e66966e7fb6c307250",
    20.0,
    "Apache-2.0 (MMPose), trained on COCO and Human-Art, the latter for non-commercial use",
    "--set detect.person_detector=FILE.onnx",
)


def _download_onnx(url: str, output: str | Path, pooch_: Any) -> None:
    """A downloader for pooch, which checks the digest of what it leaves at `output`: the .onnx file itself."""
    import pooch

    fetch = pooch.HTTPDownloader(timeout=_SECONDS)
    if not url.endswith(".zip"):
        fetch(url, str(output), pooch_)
        return
    archive_path = Path(f"{output}.zip")
    try:
        fetch(url, str(archive_path), pooch_)
        with zipfile.ZipFile(archive_path) as archive:
            held = [member for member in archive.infolist() if member.filename.endswith(".onnx")]
            if len(held) != 1:
                raise ValueError(f"{len(held)} .onnx files in {url}")
            Path(output).write_bytes(archive.read(held[0]))
    finally:
        archive_path.unlink(missing_ok=True)
