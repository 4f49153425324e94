"""MM-Fi: the toolbox's protocols, axes and joint order of small trees, and trees that contradict them."""

import numpy as np
import pytest

from pcnet3d.models.lab.mocap import mmfi as mocap_mmfi
from pcnet3d.models.lab.mocap.convert import read_folder
from pcnet3d.models.lab.mocap.mmfi import protocol
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused

EVERYBODY = {f"S{i:02d}" for i in range(1, 41)}


def people(part):
    return {subject for subject, _ in part}


@pytest.mark.parametrize(
    ("name", "tested"),
    [("S2", {f"S{i:02d}" for i in range(5, 41, 5)}), ("S3", {f"S{i}" for i in range(31, 41)})],
)
def test_across_subjects_and_across_environments(name, tested):
    split = protocol(name)
    assert people(split.test) == tested
    assert people(split.train) == EVERYBODY - tested
    assert (len(split.train), len(split.test)) == ((40 - len(tested)) * 27, len(tested) * 27)


def test_random_as_the_toolbox_draws_it():
    """Its own way: numpy's global generator, seeded anew for every action, counting from 0."""
    subjects = sorted(EVERYBODY)
    split = protocol("S1")
    state = np.random.get_state()
    for seed, action in enumerate(f"A{i:02d}" for i in range(1, 28)):
        np.random.seed(seed)
        order = np.random.permutation(40)
        expected = {subjects[i] for i in order[:32]}
        assert {s for s, a in split.train if a == action} == expected
        assert {s for s, a in split.test if a == action} == EVERYBODY - expected
    np.random.set_state(state)
    assert people(split.train) == people(split.test) == EVERYBODY


def test_activities():
    daily, rehabilitation = (protocol("S2", activities) for activities in ("P1", "P2"))
    actions = [{action for _, action in split.train} for split in (daily, rehabilitation)]
    assert [len(a) for a in actions] == [14, 13]
    assert not actions[0] & actions[1]
    assert {"A02", "A13", "A27"} <= actions[0]
    assert {"A01", "A12", "A26"} <= actions[1]
    # The seeds of the random split count the actions that are used: A03 is the second of the daily ones.
    order = np.random.RandomState(1).permutation(40)
    assert {s for s, a in protocol("S1", "P1").test if a == "A03"} == {f"S{i + 1:02d}" for i in order[32:]}


@pytest.mark.parametrize("name", ["S4", "P1"])
def test_unknown_protocols_are_refused(name):
    with refused("bad-value"):
        protocol(name)


def test_camera_axes_become_the_papers(mmfi_tree, facing_camera):
    tree = mmfi_tree({"S01": ["A01"]}, still=True)
    clip = read_folder(tree, "mmfi")[0][0]
    assert (clip.name, clip.subject, clip.source, clip.fps, len(clip)) == ("S01_A01", "S01", "mmfi", 10, 40)
    pelvis = clip.joints[0, 0]
    np.testing.assert_allclose(pelvis, [3.0, -0.2, -0.1], atol=1e-6)  # 3 m away, 0.2 m right, 0.1 m below
    r_wrist = clip.joints[0, H36M17.index("r_wrist")] - pelvis
    x, y, z = facing_camera[H36M17.index("r_wrist")]
    np.testing.assert_allclose(r_wrist, [z, -x, -y], atol=1e-6)
    assert r_wrist[1] > 0  # right is +y, as the person faces -x


def test_the_whole_tree_is_read_from_above_too(mmfi_tree):
    tree = mmfi_tree({"S05": ["A01", "A13"], "S31": ["A14"]})
    clips, notes = read_folder(tree.parent)
    assert [clip.name for clip in clips] == ["S05_A01", "S05_A13", "S31_A14"]
    assert notes == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda j: j * [-1, 1, 1], "contradict"),  # a mirrored body
        (lambda j: j[:, H36M17.mirror], "contradict"),  # left and right exchanged, coordinates right
        (lambda j: j[:, H36M17.mirror] * [-1, 1, 1], "in 0 of 4 clips"),  # both: only the hands tell
        (lambda j: j * [-1, 1, -1] + [0, 0, 6], "0 % face it"),  # turned about the vertical
        (lambda j: j * [-1, -1, 1], "0 % of the frames are upright"),  # a camera upside down
        (lambda j: 1000 * j, "metres"),
        (lambda j: j[:, :16], "frames, 17, 3"),
        (lambda j: np.where(np.arange(17)[:, None] == 3, np.nan, j), "NaN"),
        (lambda j: j.astype(int), "numbers"),
        (lambda j: np.array([{"pickled": 1}], dtype=object), "Python objects"),
    ],
)
def test_a_tree_that_contradicts_is_refused(mmfi_tree, change, words):
    tree = mmfi_tree({"S01": ["A13", "A14"], "S02": ["A17", "A18"]}, change=change)
    with pytest.raises(InputError, match=words):
        read_folder(tree)


def test_folders_that_mm_fi_does_not_have(mmfi_tree):
    tree = mmfi_tree({"S01": ["A01"]})
    (tree / "E01").rename(tree / "E02")
    with pytest.raises(InputError, match="MM-Fi has no E02/S01/A01"):
        read_folder(tree)


def test_options_that_contradict_what_is_known(mmfi_tree):
    tree = mmfi_tree({"S01": ["A01"]})
    with pytest.raises(InputError, match="are known"):
        read_folder(tree, "auto", mocap_mmfi.How(unit="mm"))
