"""How many threads may compute: what the system gives, or fewer where it is told; and many that run at once."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_keypoints, write_poses, write_video
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import run_files
from pcnet3d.pipeline.core.system import cores, cores_given
from pcnet3d.pipeline.reading.settings import RunOptions


def test_no_more_threads_than_are_given_or_told(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    given = cores()
    assert given >= 1
    for told, expected in (("1", 1), ("0", 1), (str(given + 1), given), ("many", given), ("", given)):
        monkeypatch.setenv("OMP_NUM_THREADS", told)
        assert cores() == expected, told


# What computes is opened and used as a run does it; the threads that are there then and were not before are its own.
USED = """
import io, os, pathlib, sys
import av, cv2, numpy as np, onnxruntime, pyarrow
from pcnet3d.adapters.video import read
from pcnet3d.models.common.onnx import session_of
from pcnet3d.models.lifter.builtin import SHIPPED
from pcnet3d.pipeline.files.video_frames import images_from
from pcnet3d.stages.drawing.rerun_video import h264_stream
threads = lambda: len(os.listdir("/proc/self/task"))
before = threads()
(video,) = read(pathlib.Path(sys.argv[1]))
images = images_from(video)
_, image = next(images)
with av.open(io.BytesIO(), "w", format="mp4") as target:
    encoder = h264_stream(target, image.shape[1], image.shape[0], 30.0)
    frame = av.VideoFrame.from_ndarray(image, format="rgb24").reformat(format="yuv420p", threads=1)
    frame.pts = 0
    target.mux(encoder.encode(frame))
    session = session_of(SHIPPED.read_bytes())
    cv2.resize(image, (4000, 4000), interpolation=cv2.INTER_CUBIC)
    np.matmul(*np.ones((2, 2000, 2000), np.float32))
    own = session.get_session_options().intra_op_num_threads
    print(threads() - before, cv2.getNumThreads(), own, pyarrow.cpu_count())
    target.mux(encoder.encode(None))
"""


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    path = tmp_path_factory.mktemp("video") / "walker.mp4"
    walk = walker(seconds=2)
    write_video(path, walk, side_camera(walk))
    return path


def used(video, threads: int) -> list[int]:
    """New threads, and those that OpenCV, onnxruntime and Arrow say they take."""
    code = "from pcnet3d.pipeline.core.system import limit_opencv; limit_opencv()\n" + USED
    clean = {
        name: value
        for name, value in os.environ.items()
        if not name.endswith(("_NUM_THREADS", "THREADS_NUM"))
    }
    environment = {**clean, "OMP_NUM_THREADS": str(threads)}
    said = subprocess.run(
        [sys.executable, "-c", code, video], capture_output=True, text=True, env=environment
    )
    assert said.returncode == 0, said.stderr
    return [int(word) for word in said.stdout.split()]


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
def test_told_one_thread_nothing_starts_another(video):
    new, *libraries = used(video, 1)
    assert libraries == [1, 1, 1]
    assert new == 0
    if cores_given() > 1:  # what a thread more looks like
        new, *libraries = used(video, 2)
        assert libraries == [2, 2, 2]
        assert new > 0


def test_the_command_line_limits_opencv_and_leaves_a_users_own_number(tmp_path):
    code = "import sys; sys.argv = ['pcnet3d', 'list', 'devices']\nfrom pcnet3d.pipeline.cli import main\n"
    code += "main.__globals__['app'] = lambda **_: None\nmain()\nimport cv2; print(cv2.getNumThreads())"
    for told, expected in (
        ({"OMP_NUM_THREADS": "1"}, 1),
        ({"OMP_NUM_THREADS": "1", "OPENCV_FOR_THREADS_NUM": "2"}, 2),
    ):
        clean = {name: value for name, value in os.environ.items() if name != "OPENCV_FOR_THREADS_NUM"}
        said = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, env={**clean, **told}
        )
        assert said.stdout.split() == [str(expected)], said.stderr


def test_threads_run_at_once(tmp_path):
    walk, rows, rng = walker(seconds=2), np.arange(60), np.random.default_rng(0)
    poses, keypoints, camera = tmp_path / "X3D.npy", tmp_path / "alphapose-results.json", side_camera(walk)
    write_poses(poses, walk, camera, rows, 0.008, rng)
    write_keypoints(keypoints, walk, camera, rows, 1.0, rng)
    options = RunOptions(poses=poses, keypoints=keypoints, fps=30, image_size=(camera.width, camera.height))
    failures = []

    def run(number):
        try:
            run_files(options, tmp_path / f"out{number}")
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(number,), daemon=True) for number in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert len(list(tmp_path.glob("out*/take.rrd"))) == 3
