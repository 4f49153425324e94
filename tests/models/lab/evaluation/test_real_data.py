"""Real videos are looked at as a run looks at them."""

import pytest

from pcnet3d.models.lab.evaluation import real_data


def test_the_detector_looks_as_often_as_in_a_run(monkeypatch, tmp_path):
    """It looked once: joints of the real take were 84 mm off in place of 77."""
    asked = {}

    def load(detector, **options):
        asked.update(options)
        raise NotImplementedError

    monkeypatch.setattr(real_data, "load_detector", load)
    monkeypatch.setattr(real_data, "data_folder", lambda: tmp_path)
    with pytest.raises(NotImplementedError):
        real_data.found_keypoints(None)
    assert asked == {"looks": None}
