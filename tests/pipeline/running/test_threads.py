"""Many threads of one process run at once."""

import threading

from pcnet3d.models.lab.bench import of_poses
from pcnet3d.pipeline import run_files


def test_threads_run_at_once(tmp_path):
    options = of_poses(tmp_path, 60)
    failures = []

    def run(number):
        try:
            run_files(options, tmp_path / f"out{number}")
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=run, args=(number,), daemon=True) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert len(list(tmp_path.glob("out*/take.rrd"))) == 4
