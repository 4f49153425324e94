"""Makefile, container file and workflows: each calls what there is, and none names a registry's host. Faults that the
tests are tried with stand in lines that are there."""

import re
import tomllib
from pathlib import Path

from faults import FAULTS

ROOT = Path(__file__).parents[2]
MAKEFILE = (ROOT / "Makefile").read_text(encoding="utf-8")
CONTAINER = (ROOT / "Containerfile").read_text(encoding="utf-8")
WORKFLOWS = [path.read_text(encoding="utf-8") for path in sorted((ROOT / ".github/workflows").glob("*.yml"))]


def test_workflows_and_documents_call_targets_that_exist():
    targets = set(re.findall(r"^(\w+):", MAKEFILE, re.MULTILINE))
    pages = [
        (ROOT / name).read_text(encoding="utf-8")
        for name in ("README.md", "CONTRIBUTING.md", "docs/start.md")
    ]
    called = {
        name
        for text in (*WORKFLOWS, *pages)
        for name in re.findall(r"(?:run: |^|`)make ([a-z]+)", text, re.MULTILINE)
    }
    assert called <= targets
    assert {"demo", "test", "lint"} <= {
        name for text in WORKFLOWS for name in re.findall(r"run: make ([a-z]+)", text)
    }


def test_tests_run_on_three_systems_with_the_oldest_and_the_newest_python():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pythons = [line.rpartition(" ")[2] for line in project["classifiers"] if re.search(r":: 3\.\d+$", line)]
    text = "".join(WORKFLOWS)
    assert all(f"{system}-latest" in text for system in ("ubuntu", "windows", "macos"))
    assert f'python: ["{pythons[0]}", "{pythons[-1]}"]' in text


def test_no_path_of_one_system():
    """Windows has Scripts where the others have bin."""
    assert not re.findall(r"\.venv[\w-]*/bin/", MAKEFILE + "".join(WORKFLOWS))


def test_the_container_runs_the_demo_without_a_network():
    """The build runs it; older podmans refuse RUN with --network, so its user runs it without one."""
    assert re.search(r"^RUN cd /tmp && pcnet3d demo", CONTAINER, re.MULTILINE)
    assert re.search(r"^#     podman run .*--network none .*pcnet3d demo", CONTAINER, re.MULTILINE)
    assert 'ENTRYPOINT ["pcnet3d"]' in CONTAINER


def test_no_registry_is_named():
    for text in (MAKEFILE, CONTAINER, *WORKFLOWS):
        assert not re.search(r"https?://|\b[\w-]+\.(?:io|com|org)\b|--(?:extra-)?index-url", text)


def test_every_fault_changes_a_line_that_is_there():
    """One looked for a line of the scale by flights that had been rewritten."""
    texts = {fault: (ROOT / fault.file).read_text(encoding="utf-8") for fault in FAULTS}
    assert [fault for fault, text in texts.items() if text.count(fault.old) != 1] == []


def test_every_test_that_has_to_catch_a_fault_is_there():
    """One was of a scale that had gone."""
    for named in {test for fault in FAULTS for test in fault.tests.split()}:
        file, _, name = named.partition("::")
        assert f"def {name}" in (ROOT / "tests" / file).read_text(encoding="utf-8"), named
