"""Image bytes that are equal on every machine.

Images on x86-64, ARM and WebAssembly are compared with recorded hashes. `PYTHONPATH=python:tests python
tests/viewer/web/test_same_bytes.py` writes the hashes again after an intended change.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from support.picture_bytes import HASHES, PICTURES, digest, digests, kept, label, may_differ, render

COMPLETE = [number for number in range(len(PICTURES)) if not may_differ(number, "color")]


def found(folder: Path) -> dict[str, dict[str, str]]:
    """The hashes computed on this machine."""
    return {label(number): digests(number, render(number, folder)[1]) for number in range(len(PICTURES))}


def test_images_have_the_recorded_hashes(tmp_path: Path) -> None:
    assert len(COMPLETE) >= 20
    expected = kept()
    for name, channels in found(tmp_path).items():
        assert channels == expected[name], f"{name}: the bytes differ from those of other machines"
    assert all(len(channels) >= 17 for channels in expected.values())


def test_portable_instruction_set_has_the_recorded_hashes(tmp_path: Path) -> None:
    script = "import json, sys; from viewer.web import test_same_bytes as t; from pathlib import Path;"
    script += "print(json.dumps(t.found(Path(sys.argv[1]))))"
    tests = str(Path(__file__).parents[2])
    path = os.pathsep.join([*filter(None, [tests, os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path)],
        check=True,
        capture_output=True,
        env={**os.environ, "RAYCAM_ISA": "portable", "PYTHONPATH": path},
    )
    assert json.loads(done.stdout.splitlines()[-1]) == kept()


def test_changed_pixel_changes_the_hash(tmp_path: Path) -> None:
    _, frame = render(0, tmp_path)
    before = digests(0, frame)
    depth = frame["depth"].copy()
    depth[15, 20] = np.nextafter(depth[15, 20], np.float32(0))
    assert digest(depth) != before["depth"]
    _, other = render(0, tmp_path, threads=1)
    assert digests(0, other) == before


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        HASHES.write_text(json.dumps(found(Path(folder)), indent=1) + "\n", encoding="utf-8")
    print(f"{len(PICTURES)} pictures: {HASHES}")
