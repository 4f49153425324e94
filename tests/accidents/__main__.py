"""What users do to their files by accident, and honest takes: `PYTHONPATH=tests python -m accidents FOLDER`.

Every edit is run through reading and all stages but those that write, and is refused, told by one of the codes that
it must get, or changes no stated figure by more than its 90 % error. Honest takes must get none of the notices that
these edits get. Finished ones are kept in FOLDER, so that a broken run goes on. The exit code is 1 where less than 95 %
of the edits that change a figure are refused or told, or more than 2 % of the honest takes get such a notice.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import Counter
from pathlib import Path

import numpy as np
from accidents.edits import edits
from accidents.judge import Outcome, codes_of, judged, shares
from accidents.material import bases, honest, run

from pcnet3d.models.lab.evaluation.evaluate import note_look
from pcnet3d.models.lifter.load import load_lifter
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.take import Take

# Notices that were made for these accidents, which an honest take must not get.
NEW = {
    "rate-against-movement", "rows-lost", "rows-added", "keypoints-not-of-poses", "keypoints-not-of-video",
    "depth-scaled", "joints-filled", "joints-coincide", "joints-exchanged", "limbs-copied", "repeats-itself",
    "only-noise", "left-and-right", "keypoints-smooth", "focal-contradicted", "image-stretched",
    "poses-smooth", "duplicates",
}  # fmt: skip


def main() -> int:
    """Run what is asked for, print the table and both shares."""
    parser = argparse.ArgumentParser(prog="python -m accidents", description=__doc__)
    parser.add_argument("folder", type=Path, help="where finished ones are kept")
    parser.add_argument("--only", default="", help="edits and takes whose name has this pattern")
    parser.add_argument("--part", default="", help='"first", "chosen by", "looked at once" or "last"; all')
    parser.add_argument(
        "--people", choices=("val", "train", "test", "real"), default="val", help="of honest takes"
    )
    parser.add_argument("--each", type=int, default=9, help="honest takes of every person")
    parser.add_argument("--every", type=int, default=1, help="only every so many-th edit")
    parser.add_argument("--because", default="", help="why test people are looked at; goes to the ledger")
    given = parser.parse_args()
    if (given.people == "test") != bool(given.because):
        parser.error(
            "test people are looked at rarely: give --because REASON with --people test, and only then"
        )
    outcomes = _edits(given)
    for each in outcomes:
        print(f"{each.ended:22} {each.edit:60} {', '.join(each.codes)} | {', '.join(each.changed[:4])}")
    kinds: dict[str, Counter[str]] = {}
    for each in outcomes:
        kinds.setdefault(each.edit.split(": ")[1], Counter())[each.ended.split(":")[0]] += 1
    print(
        "\n| what was done | refused | told | fine or unchanged | changed without a word |\n|---|---|---|---|---|"
    )
    for kind, of in kinds.items():
        print(
            f"| {kind} | {of['refused']} | {of['told']} | {of['fine'] + of['unchanged']} | {of['changed unsaid']} |"
        )
    alarms, of_person = _honest(given)
    if given.because:
        command = f"python -m accidents --people test --each {given.each}"
        note_look(given.folder, command, [load_lifter("pcnet3d").method], given.because)
    takes = sum(map(len, of_person.values()))
    for name, codes in alarms.items():
        print(f"false alarm: {name}: {', '.join(codes)}")
    told, asked = shares(outcomes)
    print(
        f"{len(outcomes)} edits; of {asked} that change a stated figure or are refused "
        f"{told} are refused or told: {told / max(asked, 1):.1%}"
    )
    print(
        f"of {takes} honest takes {len(alarms)} get a new notice or are refused: {len(alarms) / max(takes, 1):.1%}"
    )
    weighed = np.mean([np.mean(of) for of in of_person.values()]) if of_person else 0.0
    print(f"of {len(of_person)} people, weighed equally: {weighed:.1%}")
    return int(told < 0.95 * asked or len(alarms) > 0.02 * takes)


def _kept(path: Path) -> dict[str, dict]:
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {row["edit"]: row for row in map(json.loads, lines)}


def _edits(given: argparse.Namespace) -> list[Outcome]:
    given.folder.mkdir(parents=True, exist_ok=True)
    path, before = given.folder / "edits.jsonl", dict[str, Take]()
    done, all_bases, outcomes = _kept(path), bases(given.folder), []
    for edit in list(edits())[:: given.every]:
        if not re.search(given.only, str(edit)) or given.part not in ("", edit.part):
            continue
        if str(edit) not in done:
            done[str(edit)] = judged(edit, all_bases, before, given.folder / "run").fields()
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(done[str(edit)]) + "\n")
        outcomes.append(Outcome(**done[str(edit)]))
    return outcomes


def _honest(given: argparse.Namespace) -> tuple[dict[str, list[str]], dict[str, list[bool]]]:
    """False alarms by take, and of each person which takes have one."""
    path = given.folder / f"honest_{given.people}.jsonl"
    done, alarms, of_person = _kept(path), dict[str, list[str]](), dict[str, list[bool]]()
    for who, name, take in honest(given.people, given.each) if given.each else ():
        if name not in done:
            try:
                codes = sorted(codes_of(run(take, given.folder / "run")))
            except InputError as error:
                codes = [f"refused {error.code}"]
            done[name] = {"edit": name, "codes": codes}
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(done[name]) + "\n")
        found = [code for code in done[name]["codes"] if code in NEW or code.startswith("refused")]
        of_person.setdefault(who, []).append(bool(found))
        if found:
            alarms[name] = found
    return alarms, of_person


if __name__ == "__main__":
    sys.exit(main())
