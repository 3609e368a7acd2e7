"""Bytes of scans that are equal on every machine.

`PYTHONPATH=python:tests python tests/lidar/test_scan_bytes.py` writes the hashes again after an intended change.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.scan_bytes import HASHES, SCANS, digests, kept, street

OTHER_MACHINE = {
    "RAYCAM_ISA": "portable",
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 AVX2 FMA3",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4",
}
"""Environment in which raycam, NumPy and the C library select the code of a processor without AVX2 and FMA.

NumPy groups these features as `X86_V3` since 2.4, and ignores names that it does not have."""


def hashes() -> dict[str, dict[str, str]]:
    world = street()
    return {name: digests(name, world) for name in SCANS}


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_scans_have_the_recorded_hashes() -> None:
    expected = kept()
    for name, fields in hashes().items():
        assert fields == expected[name], f"{name}: the bytes differ from those of other machines"
    assert all(len(fields) >= 27 for fields in expected.values())


def test_scans_do_not_depend_on_the_processor() -> None:
    script = "import json; from lidar import test_scan_bytes as t; print(json.dumps(t.hashes()))"
    tests = str(Path(__file__).parents[1])
    path = os.pathsep.join([tests, *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", script],
        env={**os.environ, **OTHER_MACHINE, "PYTHONPATH": path},
        capture_output=True,
        check=True,
        text=True,
    )
    assert json.loads(done.stdout) == kept()


if __name__ == "__main__":
    HASHES.write_text(json.dumps(hashes(), indent=1) + "\n", encoding="utf-8")
