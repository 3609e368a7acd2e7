"""Runs of a script with different BLAS kernels."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

KERNELS = ("Haswell", "Prescott", "Nehalem", "SkylakeX")
"""Kernels of OpenBLAS. A processor cannot run kernels for newer processors."""


def outputs_by_kernel(script: str) -> list[bytes]:
    """Returns what a Python script prints, for each kernel with which it runs (Linux only)."""
    path = os.pathsep.join([str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    found = []
    for kernel in KERNELS:
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", script],
            env={**os.environ, "OPENBLAS_CORETYPE": kernel, "PYTHONPATH": path},
            capture_output=True,
            check=False,
        )
        if done.returncode == 0:
            found.append(done.stdout)
    return found
