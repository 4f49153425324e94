"""The YAML of files of numbers."""

import pytest

from pcnet3d.pipeline.files.number_yaml import number_yaml


def test_values_are_where_they_are():
    for text, value in [
        ("a: 1", {"a": "1"}),
        ("%YAML:1.0\n---\n# a file\na: 1 # one\n\nb: true\n...\na: 2\n", {"a": "1", "b": True}),
        ('a: \'x: [1 # y\'\n"b": "#"\n', {"a": "x: [1 # y", "b": "#"}),
        ("a: [1, -2.5e-3,\n   [3, 4],]\nb: 5", {"a": ["1", "-2.5e-3", "3", "4"], "b": "5"}),
        (
            "a: !!opencv-matrix\n  n: 1\n  data: [ 1.,\n   2. ]\nb: 0",
            {"a": {"n": "1", "data": ["1.", "2."]}, "b": "0"},
        ),
        ("a:\n- - 1\n  - -2\n- - 3\nb: 4", {"a": {"data": ["1", "-2", "3"]}, "b": "4"}),
        ("a:\n  - [1, 2]\n  - [3]\n", {"a": {"data": ["1", "2", "3"]}}),
        ("a:\n  b:\n    c: 1\n  d: 2\ne:\nf: 3", {"a": {"b": {"c": "1"}, "d": "2"}, "e": {}, "f": "3"}),
        ("a: []\nb: [ ]\nc:\n  - []\n  - [1]\n", {"a": [], "b": [], "c": {"data": ["1"]}}),
        ("", {}),
    ]:
        assert number_yaml(text) == value, text


@pytest.mark.parametrize("text", ["a, b\n", "- 1\n- 2\n", "a: [1", "{a: 1}", "a: 1\n  and more\n"])
def test_anything_else_is_refused(text):
    with pytest.raises(ValueError, match="YAML"):
        number_yaml(text)
