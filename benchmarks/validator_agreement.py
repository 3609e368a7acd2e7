"""Compares glTF-Validator's reports with raycam's, for a folder of files.

    python benchmarks/validator_agreement.py FOLDER

Prints the table of docs/gltf.md. The validator's report FILE.report.json is in the same folder as each file.
A file agrees if raycam refuses it or issues a notice. If raycam's message contains a code of the validator,
both have found the same error.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import raycam

CODE = re.compile(r"\b[A-Z0-9]+(?:_[A-Z0-9]+)+\b")


def said(path: Path) -> tuple[str, str]:
    """Returns "refused", "noticed" or "loaded", and the text of the error or notices."""
    try:
        world = raycam.load(path)
    except (raycam.Error, OSError) as fault:
        return "refused", str(fault)
    return ("noticed" if world.notices else "loaded"), " ".join(world.notices)


def main() -> None:
    print("| file | glTF-Validator's errors | raycam | codes it names |")
    print("| --- | --- | --- | --- |")
    for report in sorted(Path(sys.argv[1]).rglob("*.report.json")):
        file = report.with_name(report.name.removesuffix(".report.json"))
        issues = json.loads(report.read_text())["issues"]["messages"]
        errors = sorted({issue["code"] for issue in issues if issue["severity"] == 0})
        outcome, words = said(file)
        known = {issue["code"] for issue in issues}
        named = [code for code in dict.fromkeys(CODE.findall(words)) if code in known]
        if errors or outcome != "loaded":
            place = file.relative_to(sys.argv[1])
            print(f"| {place} | {', '.join(errors) or '-'} | {outcome} | {', '.join(named) or '-'} |")


if __name__ == "__main__":
    main()
