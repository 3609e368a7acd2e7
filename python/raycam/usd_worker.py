"""Former name of `python -m raycam.usd.worker`, kept for one release."""

from __future__ import annotations

import runpy

if __name__ == "__main__":
    runpy.run_module("raycam.usd.worker", run_name="__main__", alter_sys=True)
