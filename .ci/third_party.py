"""Writes THIRD-PARTY-NOTICES: the licences of the Rust crates in the wheel.

    python .ci/third_party.py            writes the list, as in the repository
    python .ci/third_party.py --texts    writes the list with all licence texts, as in wheels
    python .ci/third_party.py --check    fails if the list is out of date

The list contains the crates that `cargo metadata` resolves for the extension, as normal dependencies on any
platform.
"""

from __future__ import annotations

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TARGET = ROOT / "THIRD-PARTY-NOTICES"
TEXT = re.compile(r"(licen[cs]e|copying|copyright|notice|unlicense)", re.I)
RULE = "-" * 100


def crates() -> list[dict[str, object]]:
    """Returns the packages on which the extension depends, without raycam's own, sorted by name."""
    found = subprocess.run(
        ["cargo", "metadata", "--locked", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True
    )
    metadata = json.loads(found.stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    waiting = [key for key, package in packages.items() if package["name"] == "raycam-bindings"]
    reached: set[str] = set()
    while waiting:
        key = waiting.pop()
        if key in reached:
            continue
        reached.add(key)
        for dependency in nodes[key]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    chosen = [packages[key] for key in reached if packages[key]["source"] is not None]
    return sorted(chosen, key=lambda package: (package["name"], package["version"]))


def notices(with_texts: bool) -> str:
    """Returns the content of THIRD-PARTY-NOTICES."""
    lines = [
        "The wheels of raycam contain these Rust crates. Wheels have their licence texts below, each once.",
        "",
    ]
    texts: dict[str, tuple[str, list[str]]] = {}
    for package in crates():
        name = f"{package['name']} {package['version']}"
        lines.append(f"  {name}: {package['license'] or 'see its text'}")
        if not with_texts:
            continue
        folder = Path(str(package["manifest_path"])).parent
        for path in sorted(folder.iterdir()):
            if path.is_file() and TEXT.match(path.name):
                text = path.read_text(encoding="utf-8", errors="replace").strip().replace("\r\n", "\n")
                key = hashlib.sha256(" ".join(text.split()).encode()).hexdigest()
                texts.setdefault(key, (text, []))[1].append(name)
    for text, names in texts.values():
        lines += ["", RULE, ", ".join(dict.fromkeys(names)), RULE, "", text]
    return "\n".join(lines) + "\n"


def main() -> int:
    """Writes or checks the file; returns the exit status."""
    text = notices("--texts" in sys.argv[1:])
    if "--check" in sys.argv[1:]:
        if TARGET.exists() and TARGET.read_text(encoding="utf-8") == text:
            return 0
        print("THIRD-PARTY-NOTICES is out of date; run python .ci/third_party.py", file=sys.stderr)
        return 1
    TARGET.write_text(text, encoding="utf-8")
    print(f"{TARGET.name}: {text.count(chr(10))} lines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
