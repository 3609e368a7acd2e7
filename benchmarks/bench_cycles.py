"""Compares radiance with Cycles (see `radiance_agreement.py`).

`--python` names an interpreter with `bpy`.
"""

from __future__ import annotations

from radiance_agreement import compare

if __name__ == "__main__":
    compare("cycles", "Cycles", __doc__, {})
